"""Write some recordings of the XL330 as logs in the units of its registers: data/xl330/logs/*.csv.

python problems/xl330/make_logs.py [TARGET_FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from friction_ocp.recording.hdf5 import read_recording

DATA = Path(__file__).parents[2] / "data" / "xl330"
LOGS = ("lift_and_drop-kp100", "sin_sin-kp100", "lift_and_drop-kp800", "sin_time_square-kp800", "lift_and_drop-kp400")
TICKS = 4096
"""Steps of the encoder in a turn; it counts from half a turn on."""


def log(name: str) -> str:
    """Return a recording as delimited text: ms, encoder ticks, tenths of a volt, degrees Celsius."""
    channels = read_recording(DATA / f"{name}.h5").channels
    columns = {
        "t_ms": (1e3 * channels["position"].time, "%.3f"),
        "present_position": (np.rint(channels["position"].values * TICKS / (2 * np.pi)) + TICKS // 2, "%d"),
        "goal_position": (channels["goal_position"].values * TICKS / (2 * np.pi) + TICKS // 2, "%.2f"),
        "input_voltage": (10.0 * channels["supply_voltage"].values, "%d"),
        "temperature": (channels["temperature"].values, "%d"),
        "torque_enable": (channels["torque_enable"].values, "%d"),
    }
    table = np.column_stack([np.round(values, 6) for values, _ in columns.values()])
    rows = [",".join(form % value for value, (_, form) in zip(row, columns.values(), strict=True)) for row in table]
    return "\n".join([",".join(columns), *rows]) + "\n"


def main(target: Path) -> None:
    """Write all logs."""
    target.mkdir(parents=True, exist_ok=True)
    for name in LOGS:
        (target / f"{name}.csv").write_text(log(name), encoding="utf-8")


if __name__ == "__main__":
    main(Path([*sys.argv, DATA / "logs"][1]))

"""Convert the XL330 logs of Rhoban/bam (JSON) into recordings.

python problems/convert_xl330.py SOURCE_FOLDER [TARGET_FOLDER]; the target is data/xl330 unless stated.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, FloatArray, Recording

SOURCE = "Rhoban/bam, github.com/Rhoban/bam, commit af22604; recorded by A. Pirrone, 2026"
LICENCE = "Apache-2.0"
COLUMNS = {
    "position": ("position", "rad"),
    "speed": ("speed", "rad/s"),
    "load": ("load", "1"),
    "supply_voltage": ("input_volts", "V"),
    "temperature": ("temp", "degC"),
    "goal_position": ("goal_position", "rad"),
    "torque_enable": ("torque_enable", "1"),
}


def convert(source: Path) -> Recording:
    """Read one log; `load` is a 16-bit register that was logged without its sign."""
    log: dict[str, Any] = json.loads(source.read_text(encoding="utf-8"))
    entries: list[dict[str, float]] = log["entries"]
    columns = {name: _column(entries, key) for name, (key, _) in COLUMNS.items()}
    columns["load"] = columns["load"].astype(np.uint16).astype(np.int16).astype(np.float64)
    time = _column(entries, "timestamp")
    return Recording(
        name=source.stem,
        channels={name: Channel(name, time, columns[name], unit) for name, (_, unit) in COLUMNS.items()},
        title=f"Dynamixel XL330-M288 with a pendulum, {log['trajectory'].replace('_', ' ')}, kp {log['kp']}",
        source=SOURCE,
        licence=LICENCE,
        attributes={
            "trajectory": log["trajectory"],
            "mass_kg": repr(log["mass"]),
            "length_m": repr(log["length"]),
            "kp": repr(log["kp"]),
            "vin_V": repr(log["vin"]),
        },
    )


def _column(entries: list[dict[str, float]], key: str) -> FloatArray:
    return np.array([entry[key] for entry in entries], dtype=np.float64)


def main(source: Path, target: Path) -> None:
    for path in sorted(source.glob("*.json")):
        write_recording(convert(path), target / f"{path.stem}.h5")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path([*sys.argv, Path(__file__).parent.parent / "data" / "xl330"][2]))

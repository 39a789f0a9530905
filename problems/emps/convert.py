"""Convert the EMPS benchmark (MATLAB) into recordings.

FRICTION_OCP_EMPS=SOURCE_FOLDER python problems/emps/convert.py TARGET_FOLDER; the source is your own download from
nonlinearbenchmark.org. No licence is stated for the data: do not redistribute what is written.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io as _io  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, FloatArray, Recording

io: Any = _io  # its own types are incomplete

SOURCE = (
    "EMPS, nonlinearbenchmark.org; cite A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, "
    "Nonlinear System Identification Benchmarks, 2019"
)
LICENCE = "none stated; not to be redistributed"
FILES = {"DATA_EMPS.mat": "emps", "DATA_EMPS_PULSES.mat": "emps_pulses"}


def convert(source: Path) -> Recording:
    """Read one run: position and reference in m, control voltage in V, motor force gtau * vir in N."""
    content: dict[str, Any] = io.loadmat(source)
    time, gain = _column(content, "t"), float(_column(content, "gtau")[0])
    columns = {
        "position": (_column(content, "qm"), "m"),
        "reference": (_column(content, "qg"), "m"),
        "voltage": (_column(content, "vir"), "V"),
        "force": (gain * _column(content, "vir"), "N"),
    }
    if "pulses_N" in content:
        columns["pulses"] = (_column(content, "pulses_N"), "N")
    return Recording(
        name=FILES.get(source.name, source.stem.lower()),
        channels={name: Channel(name, time, values, unit) for name, (values, unit) in columns.items()},
        title="EMPS, DC motor and ball screw" + (", with force pulses" if "pulses" in columns else ""),
        source=SOURCE,
        licence=LICENCE,
        attributes={key: repr(float(_column(content, key)[0])) for key in ("kp", "kv", "gtau")},
    )


def convert_folder(source: Path, target: Path) -> list[Path]:
    """Convert what there is of the two runs; returns the files written."""
    found = [source / name for name in FILES if (source / name).is_file()]
    recordings = [convert(path) for path in found]
    written = [target / f"{recording.name}.h5" for recording in recordings]
    for recording, path in zip(recordings, written, strict=True):
        write_recording(recording, path)
    return written


def _column(content: dict[str, Any], key: str) -> FloatArray:
    return np.asarray(content[key], dtype=np.float64).ravel()


if __name__ == "__main__":
    folder = os.environ.get("FRICTION_OCP_EMPS")
    if folder is None or len(sys.argv) != 2:
        sys.exit(__doc__)
    for path in convert_folder(Path(folder), Path(sys.argv[1])):
        print(path)

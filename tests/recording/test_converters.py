"""The converted public data, and the converters that made them."""

from __future__ import annotations

import importlib.util
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from friction_ocp.recording.conditioning import detect_resolution
from friction_ocp.recording.hdf5 import read_recording

ROOT = Path(__file__).parents[2]
XL330 = sorted((ROOT / "data" / "xl330").glob("*.h5"))


def script(path: str) -> Any:
    """Load a script of the repository as a module."""
    spec = importlib.util.spec_from_file_location(Path(path).stem, ROOT / path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("path", XL330, ids=[path.stem for path in XL330])
def test_xl330_recording_follows_the_firmware(path: Path) -> None:
    """Each servo recording is sound, and its load register is the duty of the firmware's law."""
    recording = read_recording(path)
    channels = {name: channel.values for name, channel in recording.channels.items()}
    assert recording.licence == "Apache-2.0" and "af22604" in recording.source
    assert detect_resolution(channels["position"]) == pytest.approx(2.0 * np.pi / 4096, rel=1e-6)
    error = (channels["goal_position"] - channels["position"]) * 4096 / (2.0 * np.pi)
    duty = np.clip(error * float(recording.attributes["kp"]) / (256 * 885), -1.0, 1.0)
    driven = channels["torque_enable"] > 0.0
    assert np.corrcoef(channels["load"][driven], duty[driven])[0, 1] > 0.999
    assert np.max(np.abs(channels["load"])) <= 886.0


def test_all_xl330_recordings_are_there() -> None:
    """Four trajectories at three gains, with their licence."""
    assert len(XL330) == 12
    assert "Apache License" in (ROOT / "data" / "xl330" / "LICENSE").read_text()


def test_xl330_log_is_converted(tmp_path: Path) -> None:
    """A log becomes channels with units and attributes; the load register gets its sign."""
    entry = {"position": 0.1, "speed": 0.2, "load": 65535, "input_volts": 7.3, "temp": 28}
    entries = [entry | {"timestamp": time, "goal_position": 0.5, "torque_enable": True} for time in (0.0, 0.1)]
    log = {"mass": 0.49, "length": 0.1, "kp": 100, "vin": 7.4, "trajectory": "sin_sin", "entries": entries}
    (tmp_path / "sin_sin-kp100.json").write_text(json.dumps(log))
    script("problems/convert_xl330.py").main(tmp_path, tmp_path / "out")
    recording = read_recording(tmp_path / "out" / "sin_sin-kp100.h5")
    assert recording.channels["load"].values.tolist() == [-1.0, -1.0]
    assert recording.channels["torque_enable"].values.tolist() == [1.0, 1.0]
    assert recording.attributes["mass_kg"] == "0.49" and recording.attributes["vin_V"] == "7.4"


def test_emps_run_is_converted(tmp_path: Path) -> None:
    """A MATLAB run becomes position, reference, voltage and force = gtau * voltage."""
    time = np.array([[0.0], [0.001], [0.002]])
    run = {"t": time, "qm": time, "qg": 2.0 * time, "vir": time + 1.0, "gtau": 35.0, "kp": 160.0, "kv": 243.0}
    savemat(tmp_path / "DATA_EMPS.mat", run)
    written = script("problems/emps/convert.py").convert_folder(tmp_path, tmp_path / "out")
    assert [path.name for path in written] == ["emps.h5"]
    recording = read_recording(written[0])
    np.testing.assert_allclose(recording.channels["force"].values, 35.0 * (time.ravel() + 1.0))
    assert [channel.unit for channel in recording.channels.values()] == ["m", "m", "V", "N"]
    assert recording.attributes == {"kp": "160.0", "kv": "243.0", "gtau": "35.0"}


@pytest.mark.skipif("FRICTION_OCP_EMPS" not in os.environ, reason="needs the EMPS data, in FRICTION_OCP_EMPS")
def test_emps_data_are_converted(tmp_path: Path) -> None:
    """Both published runs have 24,841 samples at 1 kHz."""
    written = script("problems/emps/convert.py").convert_folder(Path(os.environ["FRICTION_OCP_EMPS"]), tmp_path)
    assert [path.stem for path in written] == ["emps", "emps_pulses"]
    assert all(read_recording(path).channels["force"].values.shape == (24841,) for path in written)

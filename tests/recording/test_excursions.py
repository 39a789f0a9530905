"""Samples that leave a signal and come back: those of lost frames and codes for errors, and no part of any motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from friction_ocp.cli import DONE, main
from friction_ocp.recording.doubts import strays_text
from friction_ocp.recording.excursions import excursions
from friction_ocp.recording.recording import Channel, FloatArray

TIME = np.arange(6000) * 1e-3
COUNT = 2.0 * np.pi / 2**16


def seen(values: FloatArray, unit: str = "rad") -> Channel:
    return Channel("x", TIME, values, unit)


def swing() -> FloatArray:
    """Return an angle in counts of an encoder."""
    turned = 6.0 * np.sin(2.2 * TIME) + 1.5 * np.sin(6.9 * TIME + 1.0)
    return COUNT * np.round(turned / COUNT)


def ringing() -> FloatArray:
    """Return an angle at rest that is hit and rings at a third of the sampling rate, lost in few swings."""
    after = np.clip(TIME - 3.0, 0.0, None)
    return 0.5 * np.exp(-after / 2e-3) * np.sin(2.0 * np.pi * 330.0 * after)


@pytest.mark.parametrize(
    "at, value",
    [
        ([1000], 4294967295 * COUNT),
        ([1000, 2200, 3700, 4800], 0.0),
        (range(1000, 1010), -9999.0),
        ([1000, 1001, 4000], np.pi * 1e3),
    ],
)
def test_codes_and_lost_frames_are_found(at: list[int], value: float) -> None:
    """All of them and nothing else, be samples missing beside them."""
    for missing in (np.empty(0, dtype=int), np.array([999, 2199, 2500])):
        values = swing()
        values[list(at)], values[missing] = value, np.nan
        assert excursions(seen(values)).tolist() == list(at)


def test_codes_in_a_current_are_found() -> None:
    """A noisy current with -9999 for what was lost."""
    values = np.sin(TIME) + 0.05 * np.random.default_rng(1).standard_normal(TIME.size)
    values[[500, 501, 4000]] = -9999.0
    assert excursions(seen(values, "A")).tolist() == [500, 501, 4000]


def test_no_motion_and_no_noise_is_called_stray() -> None:
    """Stick-slip, impacts, steps of a set point, a coarse encoder, heavy tails, switching, hits on a sensor."""
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(TIME.size)
    moves = {
        "swing": swing(),
        "quantised rest": COUNT * np.round(0.6 * noise),
        "noise of heavy tails": 1e-3 * rng.standard_t(3, TIME.size),
        "stick and slip": np.floor(3.0 * TIME) + 1e-4 * noise,
        "set point": np.where((TIME % 1.0) < 0.025, 1.0, 0.0) + 1e-5 * np.round(swing() / 1e-5),
        "bouncing": np.abs(swing()),
        "hit": ringing() + 1e-3 * noise,
        "hit at rest": np.round(ringing() / COUNT) * COUNT,
        "one move of few samples": np.clip(TIME - 3.0, 0.0, 0.02) / 0.02,
        "turned by a step": swing() + 3.0 * (TIME > 2.0),
    }
    assert [name for name, values in moves.items() if excursions(seen(values)).size] == []
    hits = np.where(np.abs(TIME - 3.0) < 2e-3, 300.0, 0.0) + noise
    switched = np.where(rng.random(TIME.size) < 2e-3, 24.0, 0.0) + 0.1 * noise
    assert not excursions(seen(hits, "rad/s^2")).size and not excursions(seen(switched, "A")).size


def test_a_counter_that_starts_over_to_and_fro_is_no_stray() -> None:
    """An axis that dithers about the place where its angle starts over loses a turn and wins it."""
    values = np.mod(0.5 * np.sin(3.0 * TIME) + 0.02 * np.sin(600.0 * TIME), 2.0 * np.pi)
    assert strays_text(seen(values)) is None


def test_the_import_tells_lost_frames(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where, how many, with which value, and what to do."""
    values = swing()
    values[[1000, 2200, 3700]] = 0.0
    rows = "".join(f"{t:.3f},{x:.9f}\n" for t, x in zip(TIME.tolist(), values.tolist(), strict=True))
    (tmp_path / "run.csv").write_text("time [s],x [rad]\n" + rows)
    head = "format: friction-ocp-map/1\ntime: {column: 'time [s]'}\nchannels:\n  x: {column: 'x [rad]'}\n"
    (tmp_path / "map.yaml").write_text(head)
    arguments = ["--map", str(tmp_path / "map.yaml"), "--out", str(tmp_path / "out.h5")]
    assert main(["import", str(tmp_path / "run.csv"), *arguments]) == DONE
    said = capsys.readouterr().err
    assert "channel 'x' leaves its course for 3 samples and comes back, first at 1.0000 s with 0 rad" in said
    assert "leave these values empty in the log, or make them NaN" in said

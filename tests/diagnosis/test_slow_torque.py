"""A slow torque of no known shape is seen where there is one, and only there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import CURRENT_NOISE, SECONDS, TORQUE_CONSTANT, axis, record, write_case
from plant import Plant, Trajectory

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.input_rounding import STRETCHES
from friction_ocp.diagnosis.rounding import Rounding, rounding_of
from friction_ocp.diagnosis.slow_torque import (
    SlowTorque,
    probes,
    significant,
    slow_torque_of,
    slow_torques,
    spread,
    stretched,
)
from friction_ocp.estimation.model import prepare
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

COARSE = 0.03
"""Counts of a current, A."""
GUSTS = 0.01
"""Deviation of the unknown torque, N m, from half second to half second."""


def plateaus(plant: Plant, name: str, seed: int) -> Recording:
    """Run a plant on a current that stays at each of eight levels, both ways in turn."""
    rng = np.random.default_rng(seed)
    levels = rng.uniform(0.32, 0.5, 8) * np.where(np.arange(8) % 2, -1.0, 1.0)
    current = Trajectory(np.arange(8) * SECONDS / 8.0, levels, "zero")
    run = plant.simulate(SECONDS, {"motor.current": current}, rng)
    units = {"position": "rad", "current": "A"}
    return Recording(name, {key: Channel(key, *run.channels[key], unit) for key, unit in units.items()})


def found(path: Path) -> SlowTorque:
    """Return the test on the only shaft of a case; its encoder is another place."""
    fitted = fit_base(prepare(load_problem(path)))
    one, _ = slow_torques(fitted, clues_of(fitted))
    return one


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_is_no_slow_torque(seed: int, tmp_path: Path) -> None:
    """A model that lacks nothing passes: noise of the current is counted once."""
    one = found(write_case(tmp_path, axis(), seed))
    assert one.p_value > 0.01
    assert one.ratio == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / (2 * STRETCHES)))


def test_coarse_counts_are_no_slow_error(tmp_path: Path) -> None:
    """An encoder of six counts a turn, which stays at one whenever the drive is slow, errs by rounding."""
    plain = axis()
    coarse = replace(plain.sensors[0], resolution=2.0 * np.pi / 6)
    path = write_case(tmp_path, replace(plain, sensors=(coarse, *plain.sensors[1:])))
    fitted = fit_base(prepare(load_problem(path)))
    clues = clues_of(fitted)
    assert all(item.p_value > 0.01 for item in slow_torques(fitted, clues))
    probe = next(item for item in probes(fitted, clues) if item.component == "position")
    white = slow_torque_of(
        fitted, probe, stretched(fitted, probe), Rounding(np.full(fitted.linear.rows.residual.size, -1))
    )
    assert white.p_value < 1e-6, "the stays are what makes the difference"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_coarse_current_is_no_slow_torque(seed: int, tmp_path: Path) -> None:
    """A current in counts of 30 mA, hardly any noise in it, errs by the same where it stays; that is no torque."""
    plain = axis()
    coarse = replace(plain.sensors[1], resolution=COARSE)
    plant = replace(plain, sensors=(plain.sensors[0], coarse))
    path = write_case(tmp_path, plant, seed)
    for k, name in enumerate("abc"):
        write_recording(plateaus(plant, name, 10 * seed + k), tmp_path / f"{name}.h5")
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["channels"]["current"] |= {"noise_std": float(np.hypot(CURRENT_NOISE, COARSE / np.sqrt(12.0)))}
    document["channels"]["current"] |= {"resolution": COARSE}
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    fitted = fit_base(prepare(load_problem(path)))
    clues = clues_of(fitted)
    assert all(item.p_value > 0.01 for item in slow_torques(fitted, clues))
    probe = next(item for item in probes(fitted, clues) if item.component == "motor")
    white = slow_torque_of(fitted, probe, stretched(fitted, probe), rounding_of(fitted))
    assert white.p_value < 1e-4, "the rounding of the current is what makes the difference"


@pytest.mark.parametrize("size", [0.0, 0.5, 20.0])
def test_the_spread_of_constants_is_told_from_noise(size: float) -> None:
    """Of 48 that are told very differently well; none where noise alone is likelier."""
    rng = np.random.default_rng(7)
    powers = np.geomspace(0.1, 1e3, 48)
    amplitudes = np.sqrt(1.0 + powers * size**2) * rng.standard_normal(48)
    assert spread(amplitudes, powers) == pytest.approx(size, rel=0.25, abs=0.03)


def test_gusts_are_seen(tmp_path: Path) -> None:
    """A torque that wanders, put into a recording as current that the model is not told of, is found."""
    path = write_case(tmp_path, axis())
    rng = np.random.default_rng(3)
    for k, name in enumerate("ab"):
        honest = record(axis(), name, 10 + k)
        current = honest.channels["current"]
        walk = np.interp(current.time, np.linspace(0, SECONDS, 9), rng.normal(0.0, GUSTS / TORQUE_CONSTANT, 9))
        hidden = Channel("current", current.time, current.values - walk, current.unit)
        write_recording(Recording(name, {**honest.channels, "current": hidden}), tmp_path / f"{name}.h5")
    one = found(path)
    assert one.p_value < 1e-6
    assert one.ratio > 2.0
    assert 0.2 < one.density / (GUSTS * np.sqrt(SECONDS / STRETCHES)) < 1.0


def test_the_level_is_shared_among_the_places() -> None:
    """One of five places that is as odd as one in a hundred is by chance is no gap."""
    others = [SlowTorque(f"place{k}", 1.0, 0.5) for k in range(4)]
    assert not significant([SlowTorque("motor", 1.5, 0.005), *others], 0.01)
    assert significant([SlowTorque("motor", 3.0, 0.001), *others], 0.01)

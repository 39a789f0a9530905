"""Periods of the torque that a model lacks, from its spectrum over the angle."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import TORQUE_CONSTANT, axis, write_case
from plant import PlantRipple

from friction_ocp.diagnosis.bench import open_bench
from friction_ocp.diagnosis.locate import shape
from friction_ocp.effects.effect import Clues, Missing, Track
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.statistics.execution import Execution

SAMPLES, INTERVAL, SEGMENT = 6000, 1e-3, 4
SPEED, TEETH, POLES = 60.0, 24, 8
"""rad/s of the motor, and waves in a turn: on short ways and on long ones."""
WAVE = 2.0
"""rad: a period of friction."""


def clues(wave: float, drift: float) -> Clues:
    """Return a motor that goes back and forth and lacks a wave over its angle beside a torque that drifts."""
    rng = np.random.default_rng(3)
    time = INTERVAL * np.arange(SAMPLES)
    omega = SPEED * np.sin(2.0 * np.pi * time / 2.0)
    theta = SPEED * (1.0 - np.cos(2.0 * np.pi * time / 2.0)) / np.pi
    middle = np.arange(SEGMENT // 2, SAMPLES, SEGMENT)
    torque = wave * np.cos(TEETH * theta[middle] + 0.4) + drift * np.sin(omega[middle] / SPEED)
    missing = Missing(
        middle,
        {"motor": torque + 0.01 * rng.standard_normal(middle.size)},
        {"motor": theta[middle]},
        {"motor": omega[middle]},
    )
    track = Track(time, {"motor": theta}, {"motor": omega}, {"drive": np.ones(SAMPLES)}, missing, missing)
    return Clues((track,), {}, {"motor": 1.0})


@pytest.mark.parametrize("drift", [0.0, 1.0])
def test_a_wave_is_found_beside_a_larger_drift(drift: float) -> None:
    """Many waves a turn, over many turns: the period is among the first, to a cycle over the whole travel."""
    found = clues(0.1, drift).periods("motor", "theta")
    travel = 2.0 * SPEED / np.pi
    assert min(abs(1.0 / period - TEETH / (2.0 * np.pi)) for period in found[:2]) < 1.0 / travel


@pytest.mark.parametrize("wave", [0.0, 0.1])
def test_a_slide_has_no_turns(wave: float) -> None:
    """What bends once over the whole travel is a trend; a wave is one from two periods on."""
    rng = np.random.default_rng(6)
    time, pitch, travel = INTERVAL * np.arange(SAMPLES), 0.032, 0.3
    omega = 0.5 * travel * np.pi * np.sin(2.0 * np.pi * time / 2.0)
    theta = 0.5 * travel * (1.0 - np.cos(2.0 * np.pi * time / 2.0))
    middle = np.arange(SEGMENT // 2, SAMPLES, SEGMENT)
    torque = (theta[middle] / travel - 0.5) ** 2 + wave * np.cos(2.0 * np.pi * theta[middle] / pitch)
    torque += 0.01 * rng.standard_normal(middle.size)
    missing = Missing(middle, {"slide": torque}, {"slide": theta[middle]}, {"slide": omega[middle]})
    track = Track(time, {"slide": theta}, {"slide": omega}, {"drive": np.ones(SAMPLES)}, missing, missing)
    found = Clues((track,), {}, {"slide": 1.0}, linear=frozenset({"slide"})).periods("slide", "theta")
    assert max(found) < 0.51 * travel
    if wave:
        assert min(abs(1.0 / period - 1.0 / pitch) for period in found[:2]) < 1.0 / travel


def test_a_wave_is_shown_within_its_period() -> None:
    """What explains a wave is the angle within its period, and the curve over that is the wave; a drift needs none."""
    found = shape(clues(0.1, 0.0), "motor")
    assert found is not None and found.variable == "motor.theta" and found.period is not None
    assert found.period == pytest.approx(2.0 * np.pi / TEETH, rel=0.01) and found.share > 0.8
    assert np.ptp(found.torque) == pytest.approx(0.2, rel=0.15)
    drifting = shape(clues(0.0, 0.1), "motor")
    assert drifting is not None and drifting.variable == "motor.omega" and drifting.period is None


def test_a_wave_of_friction_is_found_beside_what_parameters_could_do() -> None:
    """Moves to and fro with dwells, whose speed and acceleration go with the angle: a torque of either is no wave."""
    rng = np.random.default_rng(4)
    time = INTERVAL * np.arange(SAMPLES)
    omega = SPEED * np.sin(2.0 * np.pi * time / 1.5) ** 3 * (1.0 + 0.3 * np.sin(2.0 * np.pi * time / 5.0))
    theta, middle = INTERVAL * np.cumsum(omega), np.arange(SEGMENT // 2, SAMPLES, SEGMENT)
    wave = 0.2 * np.sign(omega) * np.cos(2.0 * np.pi * theta / WAVE)
    parameters = omega / SPEED + 0.05 * np.gradient(omega, time) / SPEED
    found = dict[str, float]()
    for name, size in (("wave", 0.0), ("both", 1.0)):
        torque = (wave + size * parameters)[middle] + 0.01 * rng.standard_normal(middle.size)
        missing = Missing(middle, {"motor": torque}, {"motor": theta[middle]}, {"motor": omega[middle]})
        track = Track(time, {"motor": theta}, {"motor": omega}, {"drive": np.ones(SAMPLES)}, missing, missing)
        periods = Clues((track,), {}, {"motor": 1.0}).periods("motor", "theta", against_motion=True)
        found[name] = min(abs(1.0 / period - 1.0 / WAVE) for period in periods)
    assert max(found.values()) < 1.0 / float(np.ptp(theta))


def test_a_wave_is_found_where_only_creeping_shows_it() -> None:
    """Fast moves pass more than one within each segment, and their means tell nothing of it."""
    rng, tracks = np.random.default_rng(7), list[Track]()
    time, middle = INTERVAL * np.arange(SAMPLES), np.arange(SEGMENT // 2, SAMPLES, SEGMENT)
    for k, fastest in enumerate((20.0 * SPEED, 30.0 * SPEED, 0.1 * SPEED)):
        omega = fastest * np.sin(2.0 * np.pi * time / 1.7)
        theta = INTERVAL * np.cumsum(omega)
        wave = 0.1 * np.cos(POLES * theta + 0.4)
        torque = wave.reshape(-1, SEGMENT).mean(axis=1) + 0.02 * rng.standard_normal(middle.size)
        missing = Missing(middle, {"motor": torque}, {"motor": theta[middle]}, {"motor": omega[middle]})
        moved = {"motor": theta}, {"motor": omega}, {"drive": np.ones(SAMPLES)}
        tracks.append(Track(time, *moved, missing, missing, f"run-{k}"))
    found = Clues(tuple(tracks), {}, {"motor": 1.0}).periods("motor", "theta")
    slow = float(np.ptp(tracks[-1].theta["motor"]))
    assert min(abs(1.0 / period - POLES / (2.0 * np.pi)) for period in found) < 0.1 / slow


@pytest.mark.parametrize("apart", [0.0, 40.0])
def test_a_wave_is_found_over_a_long_way(apart: float) -> None:
    """Thousands of waves, all along or in pieces far from each other: to a part of a cycle over the whole way.

    A fit of all pieces, whose waves have one phase, begins there.
    """
    rng = np.random.default_rng(5)
    tracks, began, steps = list[Track](), 0.0, 8 * SAMPLES if apart == 0.0 else SAMPLES // 2
    for _ in range(1 if apart == 0.0 else 8):
        time = began + INTERVAL * np.arange(steps)
        omega = SPEED * (1.0 + 0.2 * np.sin(2.0 * np.pi * time / 1.7))
        theta = SPEED * began + INTERVAL * np.cumsum(omega)
        middle = np.arange(SEGMENT // 2, steps, SEGMENT)
        torque = 0.05 * np.cos(POLES * theta[middle] + 0.4) + 0.05 * rng.standard_normal(middle.size)
        missing = Missing(middle, {"motor": torque}, {"motor": theta[middle]}, {"motor": omega[middle]})
        tracks.append(Track(time, {"motor": theta}, {"motor": omega}, {"drive": np.ones(steps)}, missing, missing))
        began += INTERVAL * steps + apart
    known = Clues(tuple(tracks), {}, {"motor": 1.0})
    found, way = known.periods("motor", "theta"), float(np.ptp(known.angles("motor")))
    assert way * POLES / (2.0 * np.pi) > 2000.0
    assert min(abs(1.0 / period - POLES / (2.0 * np.pi)) for period in found[:2]) < 0.25 / way


def test_a_wave_is_found_through_a_coarse_encoder(tmp_path: Path) -> None:
    """Steps of an encoder that make more of the speed than the wave does hide it from no one who knows of inertia."""
    period, plain = 1.1, axis()
    sensor = replace(plain.sensors[0], resolution=2.0 * np.pi / 2**7)
    motor = replace(plain.motors[0], cogging=PlantRipple(period, (0.03 * TORQUE_CONSTANT,), (0.0,)))
    plant = replace(plain, motors=(motor,), sensors=(sensor, plain.sensors[1]))
    bench = open_bench(load_problem(write_case(tmp_path, plant)), Execution(InProcess()))
    travel = float(np.ptp(bench.clues.angles("motor")))
    found = bench.clues.periods("motor", "theta")
    assert min(abs(1.0 / item - 1.0 / period) for item in found[:2]) < 1.0 / travel


def test_a_wave_is_found_where_the_model_loses_its_way(tmp_path: Path) -> None:
    """A ripple that takes the simulated motor waves away shows over the angle at which the motor really was."""
    period, plain = 2.0 * np.pi / 12.0, axis()
    sensor = replace(plain.sensors[0], resolution=2.0 * np.pi / 2**9)
    motor = replace(plain.motors[0], torque_ripple=PlantRipple(period, (0.9,), (0.2,)))
    plant = replace(plain, motors=(motor,), sensors=(sensor, plain.sensors[1]))
    clues = open_bench(load_problem(write_case(tmp_path, plant)), Execution(InProcess())).clues
    found = clues.periods("motor", "theta", against_torque=motor.name)
    lost = [track.theta["motor"][track.finely.middle] - track.finely.theta["motor"] for track in clues.tracks]
    assert max(float(np.ptp(one)) for one in lost) > period
    assert abs(1.0 / found[0] - 1.0 / period) < 1.0 / float(np.ptp(clues.angles("motor")))

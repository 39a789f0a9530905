"""Noise of a measured current moves the drive: segments are joined by it, and short enough for a fine encoder."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from axes import COULOMB, INERTIA, RATE, TORQUE_CONSTANT, TRUTH, VISCOUS, axis, problem
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory, steps_and_multisine

from friction_ocp import identify
from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.estimation.preparation import prepare_identification
from friction_ocp.estimation.problem import SEGMENT, Problem
from friction_ocp.estimation.torque_noise import SHORTEST
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

SECONDS = 4.0
CURRENT_NOISE, FINE = 0.02, 2e-6
"""A; rad."""
DENSITY = TORQUE_CONSTANT * CURRENT_NOISE / np.sqrt(RATE)


def run(seed: int) -> Recording:
    """Return a run of the plant under a current that is held between samples and measured with noise."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, SECONDS, 1 / RATE)
    steps = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 20.0), SECONDS, rng)
    current = np.interp(time, np.asarray(steps.time), np.asarray(steps.value))
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS)),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(PlantSensor("position", "motor.theta", period=1 / RATE, noise_std=FINE),),
    )
    channels = plant.simulate(SECONDS, {"drive.current": Trajectory(time, current, "zero")}, rng).channels
    stamps, values = channels["position"]
    noisy = current + rng.normal(0.0, CURRENT_NOISE, time.size)
    found = {"position": Channel("position", stamps, values, "rad"), "current": Channel("current", time, noisy, "A")}
    return Recording(f"run{seed}", found)


def noisy_axis(noise: float | None, *recordings: Recording, **estimation: Any) -> Problem:
    """Return the problem of finding inertia and friction from guesses that are off."""
    law = CoulombViscous(Free(0.07, 0.0, 2.0), Free(2.2e-3, 0.0, 0.03))
    drive = axis(law, inertia=Free(0.003, 1e-4, 0.04))
    current = Sensor("current", "drive.current", role="input", hold="zero", noise_std=noise)
    channels = (current, Sensor("position", "motor.theta", noise_std=FINE))
    return problem(replace(drive, channels=channels), *recordings, **estimation)


def test_intervals_hold_the_truth() -> None:
    """What a noisy current does to the motion is in the intervals, and hardly any of it in the answer, told or not.

    Segments whose length is stated are not joined by noise that nobody states.
    """
    deviations, errors, untold, usual = list[float](), list[float](), list[float](), list[float]()
    for seed in range(5):
        found = identify(noisy_axis(CURRENT_NOISE, run(seed)))
        seen = identify(noisy_axis(None, run(seed)))
        plain = identify(noisy_axis(None, run(seed), segment=SEGMENT))
        assert found.converged and seen.converged
        for item, other, without in zip(found.parameters, seen.parameters, plain.parameters, strict=True):
            true = TRUTH[item.name]
            deviations += [(each.value - true) / each.std_error for each in (item, other)]
            errors.append(item.value / true - 1.0)
            untold.append(other.value / true - 1.0)
            usual.append(without.value / true - 1.0)
    assert np.max(np.abs(deviations)) < 4.0
    assert 0.5 < np.sqrt(np.mean(np.square(deviations))) < 1.6
    assert np.sqrt(np.mean(np.square(errors))) < 0.7 * np.sqrt(np.mean(np.square(usual)))
    assert np.sqrt(np.mean(np.square(untold))) < 0.7 * np.sqrt(np.mean(np.square(usual)))


def test_torque_noise_is_that_of_the_current() -> None:
    """N m/sqrt(Hz): a new value at every sample, at the guess of the torque constant; and the segments are short."""
    model = prepare_identification(noisy_axis(CURRENT_NOISE, run(0)))
    assert model.process_noise["motor"] == pytest.approx(DENSITY)
    assert model.problem.estimation.samples == SHORTEST


@pytest.mark.parametrize(
    ("noise", "estimation", "density", "samples"),
    [
        (None, {}, {}, SEGMENT),
        (1e-9, {}, {"motor": DENSITY * 1e-9 / CURRENT_NOISE}, SEGMENT),
        (CURRENT_NOISE, {"segment": 20}, {"motor": DENSITY}, 20),
        (CURRENT_NOISE, {"process_noise": {"motor": 1e-9}}, {"motor": 1e-9}, SEGMENT),
        (CURRENT_NOISE, {"fit": "simulation"}, {}, SEGMENT),
        (CURRENT_NOISE, {"estimated_noise": ("motor",)}, {}, SEGMENT),
    ],
)
def test_what_the_problem_states_stays(
    noise: float | None, estimation: dict[str, Any], density: dict[str, float], samples: int
) -> None:
    """Torque noise, length of segments and free runs; noise that hardly moves the encoder leaves long segments."""
    model = prepare_identification(noisy_axis(noise, run(1), **estimation))
    assert model.process_noise == pytest.approx(density, rel=1e-6, abs=0.0)
    assert model.problem.estimation.samples == samples

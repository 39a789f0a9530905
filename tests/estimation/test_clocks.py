"""Clocks of the plant that are late or uncertain: delays of outputs are parameters, jitter is time as recorded."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from axes import COULOMB, ENCODER_NOISE, INERTIA, RATE, SECONDS, TORQUE_CONSTANT, TRUTH, VISCOUS, fitted_axis
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, steps_and_multisine

from friction_ocp.drive.parts import Clock
from friction_ocp.estimation.estimate import Estimate, identify
from friction_ocp.estimation.problem import Problem
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

FAR = 3.5
"""Standard errors that a right estimate keeps within."""
SECOND_ORDER = 1e-4
"""What the expansion of a delay by the motion's own derivatives leaves, s."""


def run(seed: int, shift: float = 0.0, **sensor: Any) -> Recording:
    """Return a run whose encoder has flaws; `shift` s is added to the clock of the current."""
    rng = np.random.default_rng(seed)
    current = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 40.0), SECONDS, rng)
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS)),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(PlantSensor("position", "motor.theta", period=1 / RATE, noise_std=ENCODER_NOISE, **sensor),),
    )
    position = Channel(
        "position", *plant.simulate(SECONDS, {"drive.current": current}, rng).channels["position"], "rad"
    )
    recorded = Channel("current", np.asarray(current.time) + shift, np.asarray(current.value), "A")
    return Recording(f"run{seed}", {"position": position, "current": recorded})


def delayed(*recordings: Recording, **free: Any) -> Problem:
    """Return the problem with the delay of the encoder as a parameter."""
    plain = fitted_axis(*recordings)
    current, position = plain.drive.channels
    channels = (current, replace(position, delay=Free(0.0, -0.05, 0.05, **free)))
    return replace(plain, drive=replace(plain.drive, channels=channels))


def machine_is_right(estimate: Estimate) -> bool:
    """Whether inertia and friction are those of the plant."""
    known = [item for item in estimate.parameters if item.name in TRUTH]
    return all(abs(item.value - TRUTH[item.name]) < FAR * item.std_error for item in known)


@pytest.mark.parametrize("delay", [0.004, 0.015])
def test_an_unknown_delay_is_found(delay: float) -> None:
    """The delay of the encoder is estimated beside the machine; ignored it costs many noise floors."""
    late = run(1, delay=delay)
    estimate = identify(delayed(late))
    assert machine_is_right(estimate)
    assert estimate.values["position.delay"] == pytest.approx(delay, abs=SECOND_ORDER)
    ignored = identify(fitted_axis(late))
    assert ignored.simulation.train_errors["position"][0].noise_ratio > 4.0


def test_each_recording_may_have_its_own_delay() -> None:
    """Clocks that were started by hand differ from run to run."""
    estimate = identify(delayed(run(1, delay=0.004), run(2, delay=0.009), scope="recording"))
    assert machine_is_right(estimate)
    assert estimate.values["position.delay@run1"] == pytest.approx(0.004, abs=SECOND_ORDER)
    assert estimate.values["position.delay@run2"] == pytest.approx(0.009, abs=SECOND_ORDER)


def test_a_clock_offset_of_the_input_is_a_negative_delay_of_the_output() -> None:
    """Stamps of the current that are 4 ms late make the encoder early by as much."""
    estimate = identify(delayed(run(1, shift=0.004)))
    assert machine_is_right(estimate)
    assert estimate.values["position.delay"] == pytest.approx(-0.004, abs=3 * SECOND_ORDER)


def test_jitter_that_is_recorded_costs_nothing() -> None:
    """Samples at irregular times with true stamps are as good as regular ones."""
    estimate = identify(fitted_axis(run(1, jitter=0.3 / RATE)))
    assert machine_is_right(estimate)
    assert estimate.simulation.train_errors["position"][0].noise_ratio == pytest.approx(1.0, abs=0.1)


def test_stamps_that_are_wrong_are_noise() -> None:
    """Random errors of the stamps raise the residuals, and standard errors stay honest."""
    estimate = identify(fitted_axis(run(1, stamp_error=0.2 / RATE)))
    assert machine_is_right(estimate)
    assert estimate.simulation.train_errors["position"][0].noise_ratio > 1.2


def foreign(seed: int, offset: float, drift: float) -> Recording:
    """Return a run whose encoder is stamped by another computer's clock."""
    recording = run(seed)
    position = recording.channels["position"]
    stamps = position.time + offset + drift * position.time
    return replace(recording, channels={**recording.channels, "position": replace(position, time=stamps)})


def clocked(*recordings: Recording, guess: float = 0.0, **free: Any) -> Problem:
    """Return the problem with offset and drift of the encoder's clock as parameters."""
    plain = fitted_axis(*recordings)
    current, position = plain.drive.channels
    clock = Clock("logger", Free(guess, -0.5, 0.5, **free), Free(0.0, -0.05, 0.05))
    drive = replace(plain.drive, channels=(current, replace(position, clock="logger")), clocks=(clock,))
    return replace(plain, drive=drive)


@pytest.mark.parametrize(("offset", "drift", "guess"), [(0.008, 2e-3, 0.0), (-0.012, 5e-3, 0.0), (0.26, 1e-3, 0.25)])
def test_offset_and_drift_of_a_clock_are_found(offset: float, drift: float, guess: float) -> None:
    """A logger's clock that is off and runs fast is found beside the machine, however far the guess moved stamps."""
    estimate = identify(clocked(foreign(1, offset, drift), guess=guess))
    assert estimate.converged and machine_is_right(estimate)
    found = {item.name: item for item in estimate.parameters}
    for name, truth in (("clocks.logger.offset", offset), ("clocks.logger.drift", drift)):
        item = found[name]
        assert abs(item.value - truth) < FAR * item.std_error
    assert found["clocks.logger.offset"].std_error < SECOND_ORDER
    assert found["clocks.logger.offset"].unit == "s"
    assert estimate.simulation.train_errors["position"][0].noise_ratio == pytest.approx(1.0, abs=0.1)


def test_each_recording_may_begin_on_its_own_clock() -> None:
    """The offset may differ from run to run while the drift is the clock's."""
    runs = foreign(1, 0.004, 2e-3), foreign(2, -0.009, 2e-3)
    estimate = identify(clocked(*runs, scope="recording"))
    assert machine_is_right(estimate)
    assert estimate.values["clocks.logger.offset@run1"] == pytest.approx(0.004, abs=2 * SECOND_ORDER)
    assert estimate.values["clocks.logger.offset@run2"] == pytest.approx(-0.009, abs=2 * SECOND_ORDER)


def test_a_clock_that_is_known_costs_nothing() -> None:
    """Stated numbers move the stamps, of inputs and outputs, and the fit is that of the true stamps."""
    true, late = fitted_axis(run(1)), clocked(foreign(1, 0.03, 1e-3))
    known = replace(late, drive=replace(late.drive, clocks=(Clock("logger", 0.03, 1e-3),)))
    expected, found = identify(true), identify(known)
    assert dict(found.values) == pytest.approx(dict(expected.values), rel=1e-6)

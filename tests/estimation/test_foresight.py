"""What recordings of the plant cannot tell is said before the fit, and what is recommended then helps."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from axes import CURRENT, INERTIA, POSITION, TORQUE_CONSTANT, fitted_axis, measured_axis, problem
from plant import (
    Plant,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    steps_and_multisine,
)

from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Drive, Motor, Shaft, Transmission
from friction_ocp.estimation.combinations import told
from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.foresight import Survey, doubts, expected, information, survey
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.probes import probes
from friction_ocp.estimation.problem import Problem
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import Coulomb, CoulombViscous, Viscous
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

RATE, SECONDS = 500.0, 4.0
RATIO, LOAD_INERTIA, STIFFNESS, DAMPING = 50.0, 4.0, 2.0e4, 20.0
MOTOR = PlantFriction("coulomb_viscous", tau_c=0.1, viscous=1.5e-3)
LOAD = PlantFriction("viscous", viscous=5.0)
ENCODER = Sensor("load_position", "load.theta", noise_std=3e-5)


def seen(item: Problem) -> Survey:
    found = survey(prepare(item))
    assert found is not None
    return found


def names(found: Survey) -> list[tuple[str, ...]]:
    return [tuple(found.space.names[k] for k in doubt.members) for doubt in doubts(found)]


@cache
def elastic_run() -> Recording:
    """Return a run of the plant with a soft reducer: current, motor and load encoder."""
    rng = np.random.default_rng(3)
    current = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 40.0), SECONDS, rng)
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, MOTOR), PlantShaft("load", LOAD_INERTIA, LOAD)),
        transmissions=(PlantTransmission("motor", "load", ratio=RATIO, stiffness=STIFFNESS, damping=DAMPING),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(
            PlantSensor("position", "motor.theta", period=1 / RATE, noise_std=1e-2),
            PlantSensor("load_position", "load.theta", period=1 / RATE, noise_std=3e-5),
        ),
    )
    log = plant.simulate(SECONDS, {"drive.current": current}, rng)
    channels = {name: Channel(name, *log.channels[name], "rad") for name in ("position", "load_position")}
    channels["current"] = Channel("current", np.asarray(current.time), np.asarray(current.value), "A")
    return Recording("elastic", channels)


def elastic_problem(*more: Sensor) -> Problem:
    """Return the problem of finding the friction and damping of that machine."""
    motor = FrictionElement(CoulombViscous(Free(0.08, 0.0, 1.0), Free(2e-3, 0.0, 0.02)))
    load = FrictionElement(Viscous(Free(4.0, 0.0, 50.0)))
    joint = Transmission("motor", "load", RATIO, Free(2.5e4, 1e3, 1e6), Free(10.0, 0.0, 500.0))
    shafts = (Shaft("motor", Free(2.5e-3, 1e-4, 0.1), motor), Shaft("load", LOAD_INERTIA, load))
    held = replace(CURRENT, hold="zero")
    drive = Drive(shafts, (joint,), (Motor("drive", "motor", TORQUE_CONSTANT),), None, (held, POSITION, *more))
    return problem(drive, elastic_run(), fit="simulation")


def test_friction_behind_a_rigid_gear_is_told_only_in_sum() -> None:
    """Both Coulomb torques act as one, the load's over the ratio; the inertia stays out of it."""
    plain = fitted_axis(measured_axis(1))
    shafts = (
        Shaft("motor", Free(INERTIA, 1e-4, 0.04), FrictionElement(Coulomb(Free(0.05, 0.0, 1.0)))),
        Shaft("load", 0.0, FrictionElement(Coulomb(Free(500.0, 0.0, 2e4)))),
    )
    drive = replace(plain.drive, shafts=shafts, transmissions=(Transmission("motor", "load", 15050.0),))
    found = seen(replace(plain, drive=drive))
    (doubt,) = doubts(found)
    (combination,) = told(found, doubt)
    assert combination.text({"ratio": 15050.0}) == "motor.friction.tau_c + load.friction.tau_c / 15050"
    view = found.by_sight(doubt)[0]
    added = probes(view.program, view.point, view.system, drive)
    assert {"load.theta", "motor.omega", "drive.torque"} <= {probe.measures for probe in added}
    for probe in added:
        assert np.max(replace(view, system=probe.system).errors[list(doubt.members)]) > 1.0


def test_a_scale_that_nothing_fixes_is_told_as_a_product() -> None:
    """Where the torque constant is unknown, everything is seen relative to it."""
    plain = fitted_axis(measured_axis(1))
    motor = replace(plain.drive.motors[0], torque_constant=Free(0.4, 0.1, 2.0))
    found = seen(replace(plain, drive=replace(plain.drive, motors=(motor,))))
    (doubt,) = doubts(found)
    assert [item.text({}) for item in told(found, doubt)] == [
        "motor.inertia / drive.torque_constant",
        "motor.friction.tau_c / drive.torque_constant",
        "motor.friction.viscous / drive.torque_constant",
    ]


def test_a_parameter_without_influence_is_named() -> None:
    """A shaft that nothing moves shows neither its inertia nor its viscous friction."""
    plain = fitted_axis(measured_axis(1))
    law = CoulombViscous(Free(0.07, 0.0, 2.0), Free(2e-3, 0.0, 0.03))
    idle = Shaft("idle", Free(0.1, 0.0, 1.0), FrictionElement(law))
    found = seen(replace(plain, drive=replace(plain.drive, shafts=(*plain.drive.shafts, idle))))
    assert {("idle.inertia",), ("idle.friction.viscous",)} <= set(names(found))


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_said_where_all_is_told(seed: int) -> None:
    """However poor the guess, a well excited axis and a two-mass axis with both encoders raise no doubt."""
    rng = np.random.default_rng(seed)
    for item in (fitted_axis(measured_axis(1)), elastic_problem(ENCODER)):
        model = prepare(item)
        guess = model.space.clip(model.space.guess * 10 ** rng.uniform(-0.5, 0.5, model.space.guess.size))
        found = survey(replace(model, space=model.space.moved(guess)))
        assert found is not None
        assert doubts(found) == ()


def at_answer(item: Problem, theta: np.ndarray) -> Survey:
    model = prepare(item)
    found = survey(replace(model, space=model.space.moved(theta)))
    assert found is not None
    return found


@pytest.mark.slow
def test_a_channel_that_is_recommended_tells_what_it_promised() -> None:
    """Motor and load friction seen from the motor alone trade; the fit confirms what a load encoder gains."""
    item = elastic_problem()
    found = seen(item)
    (doubt,) = doubts(found)
    assert {"motor.friction.viscous", "load.friction.viscous"} <= {found.space.names[k] for k in doubt.members}
    estimate, alone = identify(elastic_problem(ENCODER)), identify(item)
    found = at_answer(item, np.array([entry.value for entry in estimate.parameters]))
    view = found.views[0]
    before = expected(view.information).std_error
    added = {p.measures: p for p in probes(view.program, view.point, view.system, item.drive)}
    probe = added["load.theta"]
    assert probe.noise_std == pytest.approx(ENCODER.noise_std, rel=0.3)
    promised = expected(information(probe.system)).std_error
    k = found.space.names.index("load.friction.viscous")
    gained = alone.parameters[k].std_error / estimate.parameters[k].std_error
    assert before[k] / promised[k] == pytest.approx(gained, rel=0.5)
    assert gained > 4.0
    assert alone.parameters[k].verdict.traded_with == ("motor.friction.viscous",)


@pytest.mark.parametrize("seed", range(2))
def test_the_expected_errors_are_those_of_the_fit(seed: int) -> None:
    """At the answer, standard errors foreseen along the measured motion are those of the fit within a factor 1.5."""
    item = fitted_axis(measured_axis(seed))
    estimate = identify(item)
    found = at_answer(item, np.array([entry.value for entry in estimate.parameters]))
    foreseen = expected(found.views[0].information).std_error
    ratio = foreseen / np.array([entry.std_error for entry in estimate.parameters])
    assert np.all((ratio > 1 / 1.5) & (ratio < 1.5))

"""The drive in continuous time: an adaptive solver of DAEs agrees with the stepped drive."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from plant import (
    Plant,
    PlantController,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
)
from twin import Bench, drive_of

from friction_ocp.dae import Dae
from friction_ocp.drive.dae_form import dae
from friction_ocp.drive.parts import Channel, Controller, Drive, Motor, Shaft
from friction_ocp.drive.values import drive_leaves
from friction_ocp.errors import FrictionOcpError
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.maxwell import ROUNDING
from friction_ocp.friction.static import Viscous

WIDTH = 1e-5
"""rad/s; far below every speed of these motions, which do not stop."""
STEP = 2e-4
STEP_ERROR = 3e-5
"""Relative error of the second-order step of 0.2 ms on motions of up to 60 rad/s."""
DURATION = 0.5
SOLVER = {"reltol": 1e-10, "abstol": 1e-12, "max_num_steps": 100000}

QUADRATIC = PlantFriction("quadratic", tau_c=(0.1, 0.12), viscous=0.01, quadratic=0.002)
STRIBECK = PlantFriction("stribeck", 0.1, 0.15, 4.0, viscous=0.01)
LUGRE = PlantFriction("lugre", 0.1, 0.15, 2.0, viscous=0.01, sigma0=20.0, sigma1=0.05)
GMS = PlantFriction("gms", 5.0, 6.0, 2.0, viscous=0.01, elements=((6.0, 0.3), (2.0, 0.7)))
SLIPPING = replace(GMS, tau_c=0.1, tau_s=0.15)
LOADED = PlantFriction(
    "stribeck", 0.1, 0.15, 4.0, viscous=0.01, load_coulomb=0.2, load_stribeck=0.1, load_viscous=0.005
)
LOADED_LUGRE = PlantFriction("lugre", 0.1, 0.15, 2.0, viscous=0.01, sigma0=20.0, sigma1=0.05, load_coulomb=0.2)
LOAD = PlantShaft("load", 0.5, PlantFriction("viscous", viscous=0.1), (1.0, 0.2), -0.4)
TORQUE = (PlantMotor("drive", "motor", "torque"),)


def geared(friction: PlantFriction, stiffness: float) -> Plant:
    """Motor and load with ratio 5, rigid or on a spring."""
    joint = PlantTransmission("motor", "load", 5.0, stiffness, 0.5 if np.isfinite(stiffness) else 0.0)
    return Plant((PlantShaft("motor", 0.01, friction), LOAD), (joint,), TORQUE)


MOTIONS: dict[str, tuple[Plant, str, dict[str, float]]] = {
    "one mass": (Plant((PlantShaft("motor", 0.01, STRIBECK),), (), TORQUE), "torque", {"motor.omega": 8.0}),
    "two masses": (geared(QUADRATIC, 400.0), "torque", {"motor.omega": 40.0, "load.omega": 8.0}),
    "lugre": (Plant((PlantShaft("motor", 0.01, LUGRE),), (), TORQUE), "torque", {}),
    "two masses, lugre": (geared(LUGRE, 400.0), "torque", {"motor.friction.z": 1e-3}),
    "springs that do not slip": (Plant((PlantShaft("motor", 0.01, GMS),), (), TORQUE), "torque", {}),
    "loaded rigid joint": (geared(LOADED, np.inf), "torque", {"motor.omega": 8.0}),
    "loaded rigid joint, lugre": (geared(LOADED_LUGRE, np.inf), "torque", {"motor.omega": 3.0}),
    "loaded spring": (geared(LOADED, 400.0), "torque", {"motor.omega": 40.0, "load.omega": 8.0}),
    "winding": (
        Plant((PlantShaft("motor", 1e-3, QUADRATIC),), (), (PlantMotor("drive", "motor", "voltage", 0.1, 2.0, 0.02),)),
        "voltage",
        {"motor.omega": 30.0},
    ),
}


def values_of(drive: Drive) -> dict[str, float]:
    """Return every number of a drive by its path."""
    return {leaf.path: float(leaf.value) for leaf in drive_leaves(drive)}


def solved(model: Dae, drive: Drive, begin: float, end: float, initial: dict[str, float]) -> dict[str, np.ndarray]:
    """Integrate by idas under an input that goes from `begin` to `end`; return states every 10 ms after the start."""
    time, ramp = ca.SX.sym("t"), np.linspace(0.01, DURATION, 50)
    level = begin + (end - begin) * time / DURATION
    parts = {name: ca.substitute(part, model.u, level) for name, part in model.problem().items() if name != "u"}
    solver = "idas" if model.algebraic else "cvodes"
    integrate = ca.integrator("solver", solver, parts | {"t": time}, 0.0, ramp, SOLVER)
    start = model.stack(model.states, {variable.name: 0.0 for variable in model.states} | initial)
    found = integrate(x0=start, p=model.stack(model.parameters, values_of(drive)))
    return dict(zip([variable.name for variable in model.states], np.asarray(found["xf"]), strict=True))


@pytest.mark.parametrize("name", MOTIONS)
def test_an_adaptive_solver_agrees_with_the_stepped_drive(name: str) -> None:
    """On smooth motion idas and cvodes arrive where the steps do, to the error of the steps."""
    plant, signal, initial = MOTIONS[name]
    drive = drive_of(plant, {f"drive.{signal}": 0.0})
    begin, end = (4.0, 8.0) if signal == "voltage" else (0.5, 0.9)
    exact = solved(dae(drive, WIDTH), drive, begin, end, initial)
    ramp = Trajectory(np.array([0.0, DURATION]), np.array([begin, end]), "linear")
    run = Bench(drive).run(DURATION, {f"drive.{signal}": ramp}, initial, STEP, every=0.01)
    for state, values in exact.items():
        assert run[state][1:] == pytest.approx(values, abs=STEP_ERROR * np.max(np.abs(values))), state


def test_springs_that_slip_agree_to_their_rounding() -> None:
    """In continuous time the springs of a Maxwell law let go over a hundredth of their reach."""
    drive = drive_of(Plant((PlantShaft("motor", 0.01, SLIPPING),), (), TORQUE), {"drive.torque": 0.0})
    exact = solved(dae(drive, WIDTH), drive, 0.5, 0.9, {})
    ramp = Trajectory(np.array([0.0, DURATION]), np.array([0.5, 0.9]), "linear")
    run = Bench(drive).run(DURATION, {"drive.torque": ramp}, {}, STEP, every=0.01)
    for state, values in exact.items():
        assert run[state][1:] == pytest.approx(values, abs=ROUNDING * np.max(np.abs(values))), state


def test_the_torque_through_a_loaded_rigid_joint_is_algebraic() -> None:
    """Load-dependent friction across a rigid joint makes its torque an algebraic variable of index 1."""
    drive = drive_of(geared(LOADED, np.inf), {"drive.torque": 0.0})
    model = dae(drive, WIDTH)
    assert [(item.name, item.unit) for item in model.algebraic] == [("motor-load.torque", "N m")]
    at = values_of(drive) | {"motor.theta": 0.0, "motor.omega": 8.0, "drive.torque": 0.9, "motor-load.torque": 1.0}
    model.check_index1(at)
    groups = (model.states, model.algebraic, model.inputs, model.parameters)
    solve = ca.rootfinder("solve", "newton", {"x": model.z, "p": ca.vertcat(model.x, model.u, model.p), "g": model.alg})
    fixed = np.concatenate([model.stack(group, at) for group in (groups[0], groups[2], groups[3])])
    torque = float(solve(x0=1.0, p=fixed)["x"])
    ode, _, _ = model.function()(*(model.stack(group, at | {"motor-load.torque": torque}) for group in groups))
    weak, omega = np.exp(-4.0), 8.0
    own, share = 0.1 + 0.05 * weak + 0.01 * omega, 0.2 + 0.1 * weak + 0.005 * omega
    # 0.01 a = 0.9 - T / 5 - own - share T / 5;  0.5 a / 5 = T - 0.1 omega / 5 - sin(0.2) - 0.4
    rest = 0.1 * omega / 5 + np.sin(0.2) + 0.4
    alpha, wanted = np.linalg.solve([[0.01, 0.2 * (1 + share)], [0.1, -1.0]], [0.9 - own, -rest])
    rounding = 1e-9
    assert torque == pytest.approx(wanted, rel=rounding)
    assert float(ode[1]) == pytest.approx(alpha, rel=rounding)


def test_a_jamming_share_is_not_of_index_1() -> None:
    """Where the friction of the load takes the whole torque that drives it, nothing determines that torque."""
    load = PlantShaft("load", 0.5, PlantFriction("coulomb", 0.1))
    plant = Plant((PlantShaft("motor", 0.0, LOADED), load), (PlantTransmission("motor", "load", 5.0),), TORQUE)
    drive = drive_of(plant, {"drive.torque": 0.0})
    share = 0.2 + 0.1 * np.exp(-4.0) + 0.005 * 8.0
    at = values_of(drive) | {"motor.theta": 0.0, "motor.omega": -8.0, "drive.torque": 0.9, "motor-load.torque": 1.0}
    dae(drive, WIDTH).check_index1(at)
    jamming = at | {"motor.friction.load.coulomb": 1.0 - share + 0.2}
    with pytest.raises(FrictionOcpError, match=r"motor-load\.torque: not determined"):
        dae(drive, WIDTH).check_index1(jamming)


def test_every_variable_has_its_unit() -> None:
    """States, inputs and outputs carry SI units, the slope of a prescribed angle included."""
    plant = geared(LUGRE, 400.0)
    model = dae(drive_of(plant, {"load.theta": 0.0, "drive.torque": 0.0}), WIDTH)
    assert {item.name: item.unit for item in model.states} == {
        "motor.theta": "rad",
        "motor.omega": "rad/s",
        "motor.friction.z": "rad",
    }
    assert [(item.name, item.unit) for item in model.inputs] == [
        ("load.theta", "rad"),
        ("load.theta'", "rad/s"),
        ("drive.torque", "N m"),
    ]
    units = {item.name: item.unit for item in model.parameters}
    assert units["motor.friction.sigma0"] == "N m/rad" and units["motor-load.ratio"] == "1"


def test_a_sampled_controller_holds_its_command_as_an_input() -> None:
    """Between ticks a sampled controller is an input in the unit of its output."""
    loop = PlantController("loop", "pd", "angle", kp=2.0, kd=0.1)
    motor = PlantMotor("drive", "motor", "current", 0.5, controller="loop")
    plant = Plant((PlantShaft("motor", 0.01),), (), (motor,), (loop,), (PlantSensor("angle", "motor.theta"),))
    model = dae(drive_of(plant, {"reference.theta": 0.0}), WIDTH)
    assert [(item.name, item.unit) for item in model.inputs] == [("reference.theta", "rad"), ("controller.held", "A")]
    at = values_of(drive_of(plant, {"reference.theta": 0.0})) | dict.fromkeys(
        ("motor.theta", "motor.omega", "reference.theta", "controller.held"), 0.0
    )
    assert model.linearise(at).b[1] == pytest.approx([0.0, 50.0])


@pytest.mark.parametrize("delay", [0.0, 2e-3])
def test_a_continuous_controller_closes_the_loop(delay: float) -> None:
    """The poles of a continuous PD loop over a viscous shaft are those of its characteristic polynomial.

    A late angle takes from its damping.
    """
    channels = (
        Channel("angle", "axis.theta", delay=delay),
        Channel("reference", "reference.theta", "input"),
    )
    shaft = Shaft("axis", 0.01, FrictionElement(Viscous(0.05)))
    controller = Controller("pd", "angle", "torque", kp=4.0, kd=0.05)
    drive = Drive((shaft,), (), (Motor("drive", "axis"),), controller, channels)
    at = values_of(drive) | {"axis.theta": 0.0, "axis.omega": 1.0, "reference": 0.0}
    poles = np.linalg.eigvals(dae(drive, WIDTH).linearise(at).a)
    assert np.sort_complex(poles) == pytest.approx(np.sort_complex(np.roots([0.01, 0.1 - 4.0 * delay, 4.0])), rel=1e-8)


def test_a_jump_is_refused() -> None:
    """Without a width the friction jumps at standstill: the error says where exact friction is to be had."""
    with pytest.raises(FrictionOcpError, match="width > 0; use the stepped drive"):
        dae(Drive((Shaft("axis", 0.01),)), 0.0)

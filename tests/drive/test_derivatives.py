"""Derivatives of step and outputs are finite where the motion is degenerate: at rest, without friction, in the gap."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission
from test_laws_against_plant import LAWS
from twin import Bench, drive_of

MOTOR = (PlantMotor("drive", "motor", torque_constant=0.5),)
LOADED = {
    name: PlantFriction(name, tau_c=0.1, viscous=0.01, load_coulomb=0.1, load_viscous=0.01, **more)
    for name, more in {
        "coulomb_viscous": {},
        "lugre": {"tau_s": 0.2, "omega_s": 2.0, "sigma0": 100.0, "sigma1": 0.1, "load_stribeck": 0.1},
    }.items()
}


def slopes(plant: Plant, smooth: float, forget: tuple[str, ...] = ()) -> np.ndarray:
    """Return the Jacobian of step and outputs by state and parameters, at rest and with some parameters 0."""
    bench = Bench(drive_of(plant, {"drive.current": 0.0}))
    made = bench.stepped
    x, p = ca.SX.sym("x", len(made.state_names)), ca.SX.sym("p", len(made.parameter_names))
    width = [smooth] * (len(made.mechanism.topology.roots) + 1)
    values = ca.vertcat(*(f(x, 0.0, p, 1e-3, width) for f in (made.step, made.output)))
    function = ca.Function("slopes", [x, p], [values, ca.jacobian(values, ca.vertcat(x, p))])
    numbers = [
        0.0 if name in forget else number for name, number in zip(made.parameter_names, bench.numbers, strict=True)
    ]
    value, slope = function(np.zeros(len(made.state_names)), numbers)
    assert np.all(np.isfinite(np.asarray(value)))
    return np.asarray(slope)


@pytest.mark.parametrize("smooth", [0.0, 0.1])
@pytest.mark.parametrize("law", LAWS)
def test_every_law_has_finite_derivatives_at_rest(law: str, smooth: float) -> None:
    """At rest under no torque every law's step is differentiable, exact or smoothed."""
    sensors = (PlantSensor("alpha", "motor.alpha", delay=1e-3),)
    assert np.all(
        np.isfinite(slopes(Plant((PlantShaft("motor", 0.01, LAWS[law]),), (), MOTOR, sensors=sensors), smooth))
    )


@pytest.mark.parametrize("smooth", [0.0, 0.1])
@pytest.mark.parametrize(("stiffness", "backlash"), [(np.inf, 0.0), (400.0, 0.0), (400.0, 0.01)])
@pytest.mark.parametrize("law", LOADED)
def test_loaded_joints_have_finite_derivatives_at_rest(
    law: str, stiffness: float, backlash: float, smooth: float
) -> None:
    """So do rigid and elastic joints that nothing loads, with and without play."""
    shafts = (PlantShaft("motor", 0.01, LOADED[law]), PlantShaft("load", 0.4, PlantFriction("coulomb", tau_c=0.1)))
    joint = PlantTransmission("motor", "load", -4.0, stiffness, 0.0 if np.isinf(stiffness) else 1.0, backlash)
    assert np.all(np.isfinite(slopes(Plant(shafts, (joint,), MOTOR), smooth)))


def test_vanishing_levels_and_play_have_finite_derivatives() -> None:
    """Parameters at their lower bound, all Coulomb friction and the free play at 0, leave finite derivatives."""
    shafts = (
        PlantShaft("motor", 0.01, LOADED["coulomb_viscous"]),
        PlantShaft("load", 0.4, PlantFriction("coulomb", 0.1)),
    )
    none = ("motor.friction.tau_c", "load.friction.tau_c", "motor-load.backlash", "motor.friction.load.coulomb")
    for stiffness, backlash in ((np.inf, 0.0), (400.0, 0.01)):
        joint = PlantTransmission("motor", "load", 4.0, stiffness, 0.0 if np.isinf(stiffness) else 1.0, backlash)
        assert np.all(np.isfinite(slopes(Plant(shafts, (joint,), MOTOR), 0.0, none)))

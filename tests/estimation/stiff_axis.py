"""A shaft with a stiff bristle: a fine encoder sees the error of long integrator steps."""

from __future__ import annotations

from typing import Any

import numpy as np
from axes import COULOMB, CURRENT, INERTIA, TORQUE_CONSTANT, VISCOUS
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, steps_and_multisine

from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Drive, Motor, Shaft
from friction_ocp.estimation.problem import EstimationOptions, Problem, RecordingUse
from friction_ocp.friction.bristle import Dahl
from friction_ocp.friction.element import FrictionElement
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

SIGMA0 = 20.0


def stiff_problem(noise: float, **options: Any) -> Problem:
    """Return the problem of a run of the plant, seen by an encoder of this noise."""
    rng = np.random.default_rng(3)
    current = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.1, 0.25), 0.3, (0.5, 40.0), 2.0, rng)
    friction = PlantFriction("dahl", tau_c=COULOMB, sigma0=SIGMA0, viscous=VISCOUS)
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, friction),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(PlantSensor("position", "motor.theta", period=1e-3, noise_std=noise),),
    )
    (stamps, values) = plant.simulate(2.0, {"drive.current": current}, rng).channels["position"]
    channels = {
        "position": Channel("position", stamps, values, "rad"),
        "current": Channel("current", np.asarray(current.time), np.asarray(current.value), "A"),
    }
    law = Dahl(Free(0.9 * COULOMB, 0.0), Free(1.1 * SIGMA0, 0.0), Free(VISCOUS, 0.0))
    shaft = Shaft("motor", Free(INERTIA), FrictionElement(law))
    held = Sensor("current", CURRENT.measures, role="input", hold="zero")
    channels_of_drive = (held, Sensor("position", "motor.theta", noise_std=noise))
    drive = Drive((shaft,), (), (Motor("drive", "motor", TORQUE_CONSTANT),), channels=channels_of_drive)
    use = RecordingUse(Recording("run", channels))
    return Problem("stiff", drive, (use,), estimation=EstimationOptions(fit="simulation", **options))

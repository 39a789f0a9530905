"""The R.A. axis of the ARIES 50/80 cm Schmidt telescope as the plant has it, from its paper, and a loop for it."""

from __future__ import annotations

import numpy as np
from plant import Plant, PlantController, PlantFriction, PlantMotor, PlantSensor, PlantShaft

INERTIA = 1000.0
"""kg m^2; the paper does not give it, and everything between 250 and 2500 behaves sensibly."""
ARCSEC = np.pi / 180.0 / 3600.0
NUMBERS = {
    "tau_c": (200.5827, 223.9246),
    "tau_s": (1541.7090, 1289.8430),
    "omega_s": (0.00069, 0.00084),
    "sigma0": (188.48e6, 158.0188e6),
    "sigma1": (420.6185e3, 385.1324e3),
    "viscous": (118.5822e2, 123.6802e2),
}
"""Tables 1 and 2, east to west (positive) and west to east; delta = 0.85 as found there."""
DELTA = 0.85
KP, KI, SAMPLE_TIME = 2.0e5, 4.0e6, 5e-3
"""Gains of the speed loop, N m s/rad and N m/rad: stable at speed, a limit cycle where friction falls with it."""
LOOP_STEP = 0.0115 * ARCSEC
"""rad; the incremental encoder behind the friction roller, 4.608e6 x 24.5 counts a turn."""
LOG_NOISE, TORQUE_NOISE = 0.05 * ARCSEC, 1.0
"""rad and N m."""
LIMIT = 3000.0
"""N m that the motors can give at most."""
PLANT_STEP = 1e-4


def friction(scale: float = 1.0) -> PlantFriction:
    """Return the LuGre friction, its dry part times `scale`."""
    dry = {key: tuple(scale * value for value in NUMBERS[key]) for key in ("tau_c", "tau_s")}
    return PlantFriction("lugre", delta=DELTA, **(NUMBERS | dry))


def axis(log_period: float, looped: bool = True, scale: float = 1.0) -> Plant:
    """Return the axis with a log of torque and position; `looped` closes the speed loop."""
    sensors = [
        PlantSensor("position", "axis.theta", log_period, LOG_NOISE),
        PlantSensor("torque", "motor.torque", log_period, TORQUE_NOISE),
    ]
    loops: tuple[PlantController, ...] = ()
    if looped:
        sensors.append(PlantSensor("encoder", "axis.theta", SAMPLE_TIME, resolution=LOOP_STEP))
        loops = (
            PlantController(
                "loop",
                "pi_velocity",
                "encoder",
                kp=KP,
                ki=KI,
                sample_time=SAMPLE_TIME,
                saturation=(-LIMIT, LIMIT),
            ),
        )
    motor = PlantMotor("motor", "axis", "torque", controller="loop" if looped else None)
    return Plant((PlantShaft("axis", INERTIA, friction(scale)),), (), (motor,), loops, tuple(sensors))

"""An independent simulator of drives that makes the test data; it shares no code with the package under test."""

from .flaws import (
    PlantAmplifier,
    PlantEndStop,
    PlantFrictionMemory,
    PlantLoop,
    PlantRipple,
    PlantSaturation,
    PlantWarmUp,
)
from .parts import PlantController, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission
from .plant import Plant, PlantRun
from .trajectories import (
    Trajectory,
    chirp,
    constant,
    multisine,
    reversing_steps,
    slow_sine,
    staircase,
    steps_and_multisine,
)

__all__ = [
    "Plant",
    "PlantAmplifier",
    "PlantController",
    "PlantEndStop",
    "PlantFriction",
    "PlantFrictionMemory",
    "PlantLoop",
    "PlantMotor",
    "PlantRipple",
    "PlantRun",
    "PlantSaturation",
    "PlantSensor",
    "PlantShaft",
    "PlantTransmission",
    "PlantWarmUp",
    "Trajectory",
    "chirp",
    "constant",
    "multisine",
    "reversing_steps",
    "slow_sine",
    "staircase",
    "steps_and_multisine",
]

"""Turn the imperfections of the parts into the arrays that the kernels read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .flaws import PlantAmplifier, PlantFrictionMemory, PlantLoop, PlantRipple, PlantWarmUp
from .layout import (
    AMPLIFIER_STEPS,
    COGGING,
    DISTURBANCE,
    ECCENTRICITY,
    FRICTION_RIPPLE,
    KINEMATIC,
    LOOPS,
    PLACES,
    TORQUE_RIPPLE,
    VISCOUS_RIPPLE,
)
from .parts import PlantMotor, PlantSensor, PlantShaft, PlantTransmission

FORMS = {"tanh": 1, "algebraic": 2, "cubic": 3}


def ripple_rows(
    shafts: Sequence[PlantShaft],
    joints: Sequence[PlantTransmission],
    motors: Sequence[PlantMotor],
    sensors: Sequence[PlantSensor],
) -> dict[str, object]:
    """Return the harmonics of all ripples, and where those of every place begin."""
    ripples: dict[int, PlantRipple | None] = {}
    for first, parts, name in (
        (COGGING, motors, "cogging"),
        (TORQUE_RIPPLE, motors, "torque_ripple"),
        (FRICTION_RIPPLE, shafts, "ripple"),
        (VISCOUS_RIPPLE, shafts, "viscous_ripple"),
        (DISTURBANCE, shafts, "disturbance"),
        (KINEMATIC, joints, "kinematic_error"),
        (ECCENTRICITY, sensors, "eccentricity"),
    ):
        ripples |= {first + k: getattr(part, name) for k, part in enumerate(parts)}
    places = [ripples.get(place) for place in range(PLACES)]
    rows = [[] if ripple is None else list(ripple.rows()) for ripple in places]
    return {
        "wave": np.array([row for group in rows for row in group], dtype=float).reshape(-1, 3),
        "wave_at": np.concatenate(([0], np.cumsum([len(group) for group in rows]))),
    }


def shaft_rows(shafts: Sequence[PlantShaft], columns: Mapping[str, int]) -> dict[str, object]:
    """Return warm-up, friction memory, bumpers and friction inputs of the shafts."""
    warm = [shaft.warm_up or PlantWarmUp(0.0) for shaft in shafts]
    memory = [shaft.memory or PlantFrictionMemory(0.0, 1.0) for shaft in shafts]
    inputs = [[columns.get(f"{s.name}.{what}", -1) for what in ("friction_factor", "added_coulomb")] for s in shafts]
    bumpers = [s.end_stop for s in shafts]
    return {
        "warm": np.array([(w.time_constant, w.dry, w.viscous, w.power) for w in warm], dtype=float),
        "memory": np.array([(f.share, f.scale, f.time_constant) for f in memory], dtype=float),
        "friction_input": np.array(inputs, dtype=np.int64),
        "bumper": np.array([(b.low, b.high, b.stiffness, b.damping) if b else (0.0,) * 4 for b in bumpers]),
    }


def added_stiffness(part: PlantTransmission) -> float:
    """Return the stiffness that loops and a second stage add at most, N m/rad."""
    elements = part.loop.elements if part.loop else ()
    return part.second_stage[0] + sum(torque / twist for torque, twist in elements)


def joint_rows(joints: Sequence[PlantTransmission]) -> dict[str, object]:
    """Return stiffening and loops of the elastic joints."""
    spring = [(*_stiffening(part), float(part.error_over == "output")) for part in joints]
    loop = np.zeros((len(joints), LOOPS, 2))
    for e, part in enumerate(joints):
        elements = (part.loop or PlantLoop(())).elements
        if len(elements) > LOOPS:
            raise ValueError(f"{part.name}: {len(elements)} loop elements; the kernels have room for {LOOPS}")
        loop[e, : len(elements)] = np.reshape(elements, (-1, 2))
    counts = [(len(part.loop.elements), int(part.loop.smooth)) if part.loop else (0, 0) for part in joints]
    return {
        "spring": np.array(spring, dtype=float).reshape(-1, 4),
        "loop": loop,
        "loops": np.array(counts, dtype=np.int64).reshape(-1, 2),
    }


def _stiffening(part: PlantTransmission) -> tuple[float, float, float]:
    stiffness, twist = part.second_stage
    return part.cubic, stiffness, twist


def amplifier_rows(motors: Sequence[PlantMotor], step: float) -> dict[str, object]:
    """Return delay, rate limit, lag, iron and saturation of the motors."""
    amplifiers = [m.amplifier or PlantAmplifier() for m in motors]
    delays = [round(a.delay / step) for a in amplifiers]
    for motor, delay in zip(motors, delays, strict=True):
        if delay >= AMPLIFIER_STEPS:
            raise ValueError(f"{motor.name}: a delay of {delay} steps; there is room for {AMPLIFIER_STEPS - 1}")
    rows = [(a.rate_limit, a.time_constant, a.hysteresis_share, a.hysteresis_width) for a in amplifiers]
    iron = [(FORMS[m.saturation.form], m.saturation.current, m.saturation.sharpness) if m.saturation else (0, 1.0, 1.0)
            for m in motors]  # fmt: skip
    return {
        "amplifier": np.array(rows, dtype=float).reshape(-1, 4),
        "amplifier_delay": np.array(delays, dtype=np.int64),
        "iron": np.array(iron, dtype=float).reshape(-1, 3),
    }

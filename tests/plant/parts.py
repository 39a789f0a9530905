"""The parts of a simulated drive, as plain values in SI units.

The plant makes test data. It shares no code with the package under test, so an error in one is not an error in both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .flaws import (
    PlantAmplifier,
    PlantEndStop,
    PlantFrictionMemory,
    PlantLoop,
    PlantRipple,
    PlantSaturation,
    PlantWarmUp,
)

Directional = float | tuple[float, float]
"""One value, or (positive, negative) by the direction of motion."""

Law = Literal[
    "none",
    "coulomb",
    "viscous",
    "coulomb_viscous",
    "stribeck",
    "polyline",
    "quadratic",
    "dahl",
    "lugre",
    "gms",
    "polyline_hysteresis",
]


@dataclass(frozen=True)
class PlantFriction:
    """Friction of one shaft; only what `law` uses is read, `viscous` being sigma2 of the bristle laws.

    The torque opposes omega. Levels grow with the torque T that the shaft passes on towards the load, or, where it
    stands alone, with that of its motors:
    Coulomb part + load_coulomb |T|, Stribeck part + load_stribeck |T|, viscous part + load_viscous |T|.
    sigma0 and sigma1 follow the sign of the deflection, everything else the sign of the speed. The dry part of
    polyline_hysteresis is a spring that slips at tau_c and turns from one direction to the other over the travel
    `width`; gms is several springs (stiffness, share of the level at which it slips).
    """

    law: Law = "none"
    tau_c: Directional = 0.0
    tau_s: Directional | None = None
    omega_s: Directional = 0.0
    delta: Directional = 2.0
    viscous: Directional = 0.0
    quadratic: Directional = 0.0
    slopes: tuple[Directional, ...] = ()
    breaks: tuple[Directional, ...] = ()
    sigma0: Directional = 0.0
    sigma1: Directional = 0.0
    elements: tuple[tuple[float, float], ...] = ()
    width: Directional = 0.0
    load_coulomb: Directional = 0.0
    load_stribeck: Directional = 0.0
    load_viscous: Directional = 0.0


@dataclass(frozen=True)
class PlantShaft:
    """A rotary or linear inertia; gravity is (torque, phase) of -torque sin(theta + phase).

    `ripple` over the angle is added to 1 in a factor on the dry friction, `viscous_ripple` in one on the rest.
    `disturbance` is a torque over the time.
    """

    name: str
    inertia: float
    friction: PlantFriction = PlantFriction()
    gravity: tuple[float, float] = (0.0, 0.0)
    external_torque: float = 0.0
    ripple: PlantRipple | None = None
    viscous_ripple: PlantRipple | None = None
    disturbance: PlantRipple | None = None
    warm_up: PlantWarmUp | None = None
    memory: PlantFrictionMemory | None = None
    end_stop: PlantEndStop | None = None


@dataclass(frozen=True)
class PlantTransmission:
    """Joins two shafts; stiffness, damping and total free play on the output side, infinite stiffness is rigid.

    An elastic joint twisted by x beyond its play carries stiffness x + cubic x^3, beyond a twist `second_stage[1]` also
    `second_stage[0]` N m/rad more, and its `loop`. twist = theta_in / ratio + kinematic_error - theta_out, the error
    over theta_in or theta_out as `error_over` says; it does no work.
    """

    from_shaft: str
    to_shaft: str
    ratio: float = 1.0
    stiffness: float = float("inf")
    damping: float = 0.0
    backlash: float = 0.0
    cubic: float = 0.0
    second_stage: tuple[float, float] = (0.0, 0.0)
    loop: PlantLoop | None = None
    kinematic_error: PlantRipple | None = None
    error_over: Literal["input", "output"] = "input"

    @property
    def name(self) -> str:
        """The name `<from>-<to>`."""
        return f"{self.from_shaft}-{self.to_shaft}"


@dataclass(frozen=True)
class PlantMotor:
    """A motor on a shaft; its command is share * command + bias in the unit of `drive`.

    The command comes from the input `<name>.<drive>` or from `controller`. The input `<name>.enable` (default 1) cuts
    current and torque below 0.5. The command passes the `amplifier`. `cogging` is a torque over the angle;
    `torque_ripple` over the angle is added to 1 in a factor on the torque constant.
    """

    name: str
    shaft: str
    drive: Literal["current", "torque", "voltage"] = "current"
    torque_constant: float = 1.0
    resistance: float = 1.0
    inductance: float = 0.0
    share: float = 1.0
    bias: float = 0.0
    controller: str | None = None
    cogging: PlantRipple | None = None
    torque_ripple: PlantRipple | None = None
    saturation: PlantSaturation | None = None
    amplifier: PlantAmplifier | None = None


@dataclass(frozen=True)
class PlantController:
    """A sampled control law whose command is held between ticks.

    p: kp (theta_ref - theta); pd: the same + kd (omega_ref - omega);
    pi_velocity: kp e + ki int(e), e = omega_ref - omega;
    cascade: e = kp (theta_ref - theta) + omega_ref - omega, command kd e + ki int(e);
    duty: saturation(kp (theta_ref - theta)) * supply. EMPS is pd with kp = kv kp', kd = kv and no omega_ref.
    The references are the inputs `<reference>.theta` and `<reference>.omega`, zero where missing. `feedback` is the
    name of a sensor; the speed is that of `rate_feedback`, or of `feedback` if it measures omega, else its derivative.
    Anti-windup stops the integral while the command is saturated outward.
    """

    name: str
    type: Literal["p", "pd", "pi_velocity", "cascade", "duty"]
    feedback: str
    kp: float = 0.0
    ki: float = 0.0
    kd: float = 0.0
    sample_time: float = 1e-3
    delay: float = 0.0
    saturation: tuple[float, float] = (-float("inf"), float("inf"))
    anti_windup: bool = True
    derivative: Literal["backward", "two_tap_mean"] = "backward"
    rate_feedback: str | None = None
    supply: float = 1.0
    reference: str = "reference"


@dataclass(frozen=True)
class PlantSensor:
    """recorded(t) = gain * true(t - delay) + offset + noise, rounded to `resolution`.

    `measures` is `<shaft>.theta|omega|alpha`, `<motor>.current|torque|voltage`, `<motor>.command` (before the
    amplifier), or the name of any input, such as `reference.theta` or `motor.enable`. alpha is the acceleration
    without the white torque noise, whose own variance is infinite. `jitter` moves the sampling instants, `stamp_error`
    falsifies the recorded times (both standard deviations, clipped at 0.4 periods, the latter at 0.05 where both act);
    `dropout` is the probability of a NaN. `eccentricity` over the angle is added to a true angle, its slope to a speed.
    """

    name: str
    measures: str
    period: float = 1e-3
    noise_std: float = 0.0
    gain: float = 1.0
    offset: float = 0.0
    delay: float = 0.0
    resolution: float = 0.0
    jitter: float = 0.0
    stamp_error: float = 0.0
    dropout: float = 0.0
    eccentricity: PlantRipple | None = None

"""The parts of a drive. Their fields are their parameters: unit kind and meaning are stated once, here.

Inertia, friction, gravity and external torque of a shaft are on its own side; stiffness, damping and
backlash of a transmission are on its output side; ratio = speed_in / speed_out.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import sqrt
from typing import Any, Literal

from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.maxwell import STIFFNESSES, Spring, SpringShares
from friction_ocp.friction.smoothing import cos, sin
from friction_ocp.friction.static import NoFriction
from friction_ocp.friction.wave import Wave
from friction_ocp.parameters import Value, is_off, quantity

Motion = Literal["rotary", "linear"]
ControllerType = Literal["duty", "p", "pd", "pi_velocity", "cascade"]
Role = Literal["input", "output"]
Hold = Literal["zero", "linear"]
DRIVING_SIGNALS = ("torque", "current", "voltage")
"""Signals of a motor that make it turn when they are inputs."""


@dataclass(frozen=True)
class Gravity:
    """Torque -torque sin(theta + phase) of an unbalanced mass."""

    torque: Value = quantity("torque", "gravity torque at 90 deg")
    phase: Value = quantity("angle", "angle at which gravity vanishes", 0.0)


@dataclass(frozen=True)
class ExternalTorque:
    """A torque that does not change."""

    constant: Value = quantity("torque", "constant torque")


@dataclass(frozen=True)
class Disturbance(Wave, kind="torque", of="the external torque", over="time", period="the external torque"):
    """An external torque periodic in the time since the start of the recording."""


@dataclass(frozen=True)
class Cogging(
    Wave, kind="torque", of="the cogging torque", over="angle", period="the cogging torque over the shaft's angle"
):
    """A torque on the motor's shaft periodic in its angle, whether or not there is current."""


@dataclass(frozen=True)
class TorqueRipple(
    Wave,
    kind="dimensionless",
    of="the relative torque ripple",
    over="angle",
    period="the torque ripple over the shaft's angle",
):
    """Torque of the motor times 1 + a wave over its shaft's angle."""


@dataclass(frozen=True)
class Eccentricity:
    """Once-per-turn error of a sensor: it sees theta + cosine (cos theta - 1) + sine sin theta."""

    cosine: Value = quantity("angle", "cosine part of the once-per-turn error", 0.0)
    sine: Value = quantity("angle", "sine part of the once-per-turn error", 0.0)

    @property
    def idle(self) -> bool:
        """Whether both parts are plainly zero."""
        return is_off(self.cosine) and is_off(self.sine)

    def error(self, theta: Any) -> Any:
        """Return what the sensor shows too much."""
        return self.cosine * (cos(theta) - 1.0) + self.sine * sin(theta)

    def seen(self, motion: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
        """Return angle, speed and acceleration as the sensor sees them."""
        theta, omega, alpha = motion
        slope = 1.0 - self.cosine * sin(theta) + self.sine * cos(theta)
        bend = -self.cosine * cos(theta) - self.sine * sin(theta)
        return theta + self.error(theta), slope * omega, slope * alpha + bend * omega**2

    def undone(self, theta: Any, omega: Any) -> tuple[Any, Any]:
        """Return true angle and speed from those seen, to third order in the error."""
        true = theta - self.error(theta - self.error(theta))
        return true, omega / (1.0 - self.cosine * sin(true) + self.sine * cos(true))


@dataclass(frozen=True)
class Shaft:
    """A rigid body that turns (or moves along a line)."""

    name: str
    inertia: Value = quantity("inertia", "inertia")
    friction: FrictionElement = FrictionElement(NoFriction())
    gravity: Gravity | None = None
    external_torque: ExternalTorque | None = None
    motion: Motion = "rotary"
    disturbance: Disturbance | None = None


@dataclass(frozen=True)
class LoopSprings(SpringShares):
    """Springs that slip, beside a bristle in a transmission."""

    twist: Value = quantity("angle", "twist after which the middle spring slips")

    def under(self, torque: Any) -> tuple[Spring, ...]:
        """Return the springs of a loop of some torque."""
        reaches = [self.twist / factor for factor in STIFFNESSES]
        return tuple(Spring(torque * share / reach, reach) for reach, share in zip(reaches, self.shares, strict=True))


@dataclass(frozen=True)
class Hysteresis:
    r"""A bristle between two shafts, beside the spring: the twist has a loop.

    .. math:: \dot z = r - |r| z / \text{twist}, \qquad \tau = \text{torque} \cdot z / \text{twist}

    r is the rate of the twist. Source: Dahl 1968, with exponent 1. Springs that slip take their shares of the torque.
    """

    torque: Value = quantity("torque", "torque of the loop")
    twist: Value = quantity("angle", "twist over which the loop turns", nested="guess")
    springs: LoopSprings | None = None

    @property
    def deflections(self) -> tuple[str, ...]:
        """Names of its states."""
        return ("z", *(() if self.springs is None else self.springs.deflections))

    @property
    def idle(self) -> bool:
        """Whether its torque is plainly zero."""
        return is_off(self.torque)


ROUNDING = sqrt(0.5)
"""Of a second stage, over its twist: between a kink and the cubic law."""


@dataclass(frozen=True)
class SecondStage:
    r"""A spring that takes part from about a twist on, as the data sheets of strain wave gears have it.

    .. math:: \tau = k \left(w + \frac{\sqrt{(w - s)^2 + r^2} - \sqrt{(w + s)^2 + r^2}}{2 c}\right),
        \quad c = \sqrt{1 - \text{rounding}^2}, \; s = c \cdot \text{twist}, \; r = \text{rounding} \cdot \text{twist}

    Nothing at w = 0 and k (w - twist) far beyond; up to the twist it grows with w^3.
    """

    stiffness: Value = quantity("stiffness", "stiffness of the second stage")
    twist: Value = quantity("angle", "twist from which the second stage takes part", nested="guess")
    rounding: Value = quantity("dimensionless", "rounding of the second stage's beginning over its twist", ROUNDING)

    @property
    def idle(self) -> bool:
        """Whether its stiffness is plainly zero."""
        return is_off(self.stiffness)


@dataclass(frozen=True)
class KinematicError(
    Wave, kind="angle", of="the kinematic error", over="input_angle", period="the kinematic error over the input angle"
):
    """Angle by which the output side is ahead of the ratio, periodic in the angle of the input shaft."""


@dataclass(frozen=True)
class Transmission:
    """A reducer, coupling or screw between two shafts; `stiffness` None joins them rigidly.

    Twisted by w beyond its play it carries stiffness w + stiffening w^3, and what its second stage does.
    """

    from_shaft: str
    to_shaft: str
    ratio: Value = quantity("dimensionless", "speed in over speed out", 1.0)
    stiffness: Value = quantity("stiffness", "stiffness", None)
    damping: Value = quantity("viscous", "damping", 0.0)
    backlash: Value = quantity("angle", "free play", 0.0)
    stiffening: Value = quantity("cubic_stiffness", "cubic stiffness", 0.0)
    second_stage: SecondStage | None = None
    hysteresis: Hysteresis | None = None
    kinematic_error: KinematicError | None = None

    @property
    def name(self) -> str:
        """The name in results: `<from>-<to>`."""
        return f"{self.from_shaft}-{self.to_shaft}"

    @property
    def rigid(self) -> bool:
        """Whether the two shafts always move together."""
        return self.stiffness is None


SHARPNESS = 2.0
"""Of saturation that grows with the square of the current."""


@dataclass(frozen=True)
class Motor:
    """An electric motor on a shaft; its back-EMF constant equals its torque constant.

    What drives it (current, torque or voltage) follows its command after `dead_time` with a time constant `lag`; where
    it is alone and no controller is simulated, all that is seen of the drive is later by the dead time. A recorded
    current or voltage lags less than the motor by the share `lag_hidden`: with 1 it is the command. The torque that a
    current i would make is divided by (1 + (saturation i^2)^(p/2))^(1/p), where p is `saturation_sharpness` and i the
    torque over the torque constant where torque drives it; with a `saturation_tail` q by (1 + q s)^(1/q),
    s = (saturation i^2)^(p/2) / p, which is the same for q = p, falls further for less, as an exponential for 0 and as
    1 - s for -1. The back-EMF falls alike where flux is missing, and keeps what losses take: `saturation_in_emf` is the
    share that it lacks.
    """

    name: str
    shaft: str
    torque_constant: Value = quantity("torque_constant", "torque constant", 1.0)
    resistance: Value = quantity("resistance", "winding resistance", None)
    inductance: Value = quantity("inductance", "winding inductance", None)
    share: Value = quantity("dimensionless", "share of the command", 1.0)
    cogging: Cogging | None = None
    torque_ripple: TorqueRipple | None = None
    lag: Value = quantity("time", "time constant with which the motor follows its command", 0.0)
    saturation: Value = quantity("saturation", "1 / I^2 of the current I that makes all torque that there is", 0.0)
    saturation_sharpness: Value = quantity("dimensionless", "how suddenly the torque ceases to rise", SHARPNESS)
    saturation_tail: Value = quantity("dimensionless", "how much torque further current still adds", None)
    saturation_in_emf: Value = quantity("dimensionless", "share of the missing torque that the back-EMF lacks too", 1.0)
    dead_time: Value = quantity("time", "time after which the motor begins to follow its command", 0.0)
    lag_hidden: Value = quantity("dimensionless", "share of the lag that a recorded current does not show", 0.0)


@dataclass(frozen=True)
class Controller:
    """Closes the loop from a reference through the feedback channel."""

    type: ControllerType
    feedback: str
    output: Literal["voltage", "current", "torque"] = "voltage"
    kp: Value = quantity("gain", "proportional gain", 0.0)
    ki: Value = quantity("gain", "integral gain", 0.0)
    kd: Value = quantity("gain", "derivative (inner speed) gain", 0.0)
    sample_time: float | None = None
    delay: float = 0.0
    saturation: tuple[Value, ...] | None = quantity("gain", "output limit", None)
    anti_windup: bool = True
    derivative: Literal["backward", "two_tap_mean"] = "backward"


@dataclass(frozen=True)
class Clock:
    """The clock of a logger beside the others: it shows t + offset + drift t, t being the time since the start."""

    name: str
    offset: Value = quantity("time", "what the clock is fast by at the start", 0.0)
    drift: Value = quantity("dimensionless", "what the clock gains in a second", 0.0)

    @property
    def path(self) -> str:
        """What its numbers are named by."""
        return f"clocks.{self.name}"


@dataclass(frozen=True)
class Channel:
    """A recorded signal: recorded(t) = gain * true(t - delay) + offset, quantised by `resolution`.

    With `eccentricity` true is what an eccentric sensor of the angle sees; with `clock` t is what that clock shows.
    """

    name: str
    measures: str
    role: Role = "output"
    gain: Value = quantity("dimensionless", "sensor gain", 1.0)
    offset: Value = quantity("channel", "sensor offset", 0.0)
    delay: Value = quantity("time", "sensor delay", 0.0)
    resolution: float | None = None
    noise_std: float | None = None
    hold: Hold = "linear"
    eccentricity: Eccentricity | None = None
    clock: str = ""
    """Name of the clock that stamps it; empty for that of the recording."""

    @property
    def part(self) -> str:
        """Name of the shaft, motor or `reference` that the channel looks at."""
        return self.measures.partition(".")[0]

    @property
    def signal(self) -> str:
        """What it looks at there: theta, omega, alpha, current, ..."""
        return self.measures.partition(".")[2]

    @property
    def is_driving(self) -> bool:
        """Whether it is an input that moves the machine: a set point, a command or a prescribed motion."""
        return self.role == "input" and self.signal in ("theta", "omega", *DRIVING_SIGNALS, "current_command")


@dataclass(frozen=True)
class Drive:
    """A drive chain: parts joined by their names."""

    shafts: tuple[Shaft, ...]
    transmissions: tuple[Transmission, ...] = ()
    motors: tuple[Motor, ...] = ()
    controller: Controller | None = None
    channels: tuple[Channel, ...] = field(default=())
    clocks: tuple[Clock, ...] = ()

    def shaft(self, name: str) -> Shaft:
        """Return the shaft called `name`; KeyError lists the shafts that exist."""
        for shaft in self.shafts:
            if shaft.name == name:
                return shaft
        raise KeyError(f"no shaft '{name}'; there are {', '.join(shaft.name for shaft in self.shafts)}")

    def motor(self, name: str) -> Motor:
        """Return the motor called `name`; KeyError lists the motors that exist."""
        for motor in self.motors:
            if motor.name == name:
                return motor
        raise KeyError(f"no motor '{name}'; there are {', '.join(motor.name for motor in self.motors)}")

    def clock_of(self, channel: Channel) -> Clock | None:
        """Return the clock of its own that stamps a channel; None where that is the clock of the recording."""
        return next((clock for clock in self.clocks if clock.name == channel.clock), None)

    def driving_signal(self, motor: Motor) -> str | None:
        """Return what drives a motor: torque, current or voltage; None where nothing does."""
        given, controller = {channel.measures for channel in self.inputs}, self.controller
        for signal in DRIVING_SIGNALS:
            if f"{motor.name}.{signal}" in given or (controller is not None and controller.output == signal):
                return signal
        return "current" if f"{motor.name}.current_command" in given else None

    @property
    def delaying(self) -> tuple[Motor, ...]:
        """The motors whose dead time only makes all outputs as late: one alone, whose command no loop makes."""
        return self.motors if self.controller is None and len(self.motors) == 1 else ()

    @property
    def acted_on(self) -> Channel | None:
        """The input that alone moves the machine, so that all outputs are early where it is recorded late.

        None where a loop is closed, or several inputs move it.
        """
        driving = [item for item in self.inputs if item.is_driving]
        return driving[0] if self.controller is None and len(driving) == 1 else None

    @property
    def recorded_late(self) -> Channel | None:
        """That input if how late it is recorded is to be found; a known delay shifts its samples."""
        moves = self.acted_on
        return None if moves is None or isinstance(moves.delay, (int, float)) else moves

    @property
    def prescribing(self) -> tuple[Channel, ...]:
        """The inputs that prescribe the motion of a shaft."""
        shafts = {shaft.name for shaft in self.shafts}
        return tuple(item for item in self.inputs if item.part in shafts and item.signal in ("theta", "omega"))

    @property
    def prescribed(self) -> frozenset[str]:
        """The shafts whose motion is an input."""
        return frozenset(channel.part for channel in self.prescribing)

    @property
    def inputs(self) -> tuple[Channel, ...]:
        """The channels that drive the simulation."""
        return tuple(channel for channel in self.channels if channel.role == "input")

    @property
    def outputs(self) -> tuple[Channel, ...]:
        """The channels that the simulation predicts."""
        return tuple(channel for channel in self.channels if channel.role == "output")

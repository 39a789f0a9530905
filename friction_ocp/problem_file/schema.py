"""The sections of a problem file; each builds its part of the problem."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import Field, PlainValidator, model_validator

from friction_ocp.drive.parts import (
    SHARPNESS,
    Channel,
    Clock,
    Controller,
    ControllerType,
    Drive,
    Hold,
    Motion,
    Motor,
    Role,
    Shaft,
    Transmission,
)
from friction_ocp.estimation.problem import EstimationOptions, Fit, InitialState, Loss, Solver
from friction_ocp.parameters import Value
from friction_ocp.problem_file.friction_section import read_friction
from friction_ocp.problem_file.numbers import (
    Finite,
    GuessedLevel,
    NoiseNumber,
    NotNegative,
    Number,
    Positive,
    read_number,
)
from friction_ocp.problem_file.sections import (
    NUMBER_FORMS,
    ChannelName,
    Fault,
    Location,
    NumberMark,
    PartName,
    Section,
    given,
    refuse,
    shown,
)
from friction_ocp.problem_file.term_sections import (
    CoggingTerm,
    DisturbanceTerm,
    EccentricityTerm,
    ExternalTorqueTerm,
    GravityTerm,
    HysteresisTerm,
    KinematicErrorTerm,
    SecondStageTerm,
    TorqueRippleTerm,
)

FORMAT = "friction-ocp-problem/1"
INPUT_ONLY = ("supply_voltage", "enable", "current_command")
"""Signals of a motor that are given to the drive, never predicted by it."""


class ShaftSection(Section):
    name: PartName
    inertia: Number
    friction: Annotated[Any, PlainValidator(read_friction)] = None
    gravity: GravityTerm = None
    external_torque: ExternalTorqueTerm = None
    motion: Motion = "rotary"
    disturbance: DisturbanceTerm = None

    def build(self) -> Shaft:
        stated = given(self, *(key for key in self.keys() if key not in ("name", "inertia")))
        return Shaft(self.name, self.inertia, **stated)


def _read_stiffness(value: Any) -> Value:
    if isinstance(value, str) and value == "rigid":
        return None
    if isinstance(value, str):
        raise refuse("stiffness", [Fault((), f"this is {shown(value)}", f"rigid, or {NUMBER_FORMS}", number=())])
    return read_number(value)


class TransmissionSection(Section):
    from_shaft: str | None = Field(None, alias="from")
    to_shaft: str | None = Field(None, alias="to")
    ratio: Number = 1.0
    stiffness: Annotated[Any, PlainValidator(_read_stiffness), NumberMark()]
    damping: Number = 0.0
    backlash: Number = 0.0
    stiffening: Number = 0.0
    second_stage: SecondStageTerm = None
    hysteresis: HysteresisTerm = None
    kinematic_error: KinematicErrorTerm = None

    def build(self, between: tuple[str, str]) -> Transmission:
        stated = given(self, *(name for name in type(self).model_fields if name not in ("from_shaft", "to_shaft")))
        return Transmission(self.from_shaft or between[0], self.to_shaft or between[1], **stated)


class MotorSection(Section):
    name: PartName = "motor"
    shaft: str | None = None
    torque_constant: Number = 1.0
    resistance: Number = None
    inductance: Number = None
    share: Number = 1.0
    cogging: CoggingTerm = None
    torque_ripple: TorqueRippleTerm = None
    lag: Number = 0.0
    lag_hidden: Number = 0.0
    dead_time: Number = 0.0
    saturation: Number = 0.0
    saturation_sharpness: Number = SHARPNESS
    saturation_tail: Number = None
    saturation_in_emf: Number = 1.0

    def build(self, first_shaft: str) -> Motor:
        stated = given(self, *(key for key in self.keys() if key not in ("name", "shaft")))
        return Motor(self.name, self.shaft or first_shaft, **stated)


class ControllerSection(Section):
    type: ControllerType
    feedback: str
    output: Literal["voltage", "current", "torque"] = "voltage"
    kp: Number = 0.0
    ki: Number = 0.0
    kd: Number = 0.0
    sample_time: Positive | None = None
    delay: NotNegative = 0.0
    saturation: list[Number] | None = Field(None, min_length=2, max_length=2)
    anti_windup: bool = True
    derivative: Literal["backward", "two_tap_mean"] = "backward"

    def build(self) -> Controller:
        limits = None if self.saturation is None else tuple(self.saturation)
        stated = given(self, *(key for key in self.keys() if key != "saturation"))
        return Controller(**stated, saturation=limits)


class DriveSection(Section):
    shafts: list[ShaftSection] = Field(min_length=1)
    transmissions: list[TransmissionSection] = Field(default_factory=list[TransmissionSection])
    motor: MotorSection | None = None
    motors: list[MotorSection] = Field(default_factory=list[MotorSection])
    controller: ControllerSection | None = None

    @model_validator(mode="after")
    def _places_are_stated(self) -> Self:
        faults = [*self._unplaced_transmissions(), *self._unplaced_motors()]
        if faults:
            raise refuse("drive", faults)
        return self

    def _unplaced_transmissions(self) -> Iterator[Fault]:
        if len(self.transmissions) == len(self.shafts) - 1:
            return
        what = "this key is missing"
        allowed = f"only a plain chain leaves it out: {len(self.shafts)} shafts, {len(self.shafts) - 1} transmissions"
        for k, item in enumerate(self.transmissions):
            for key, name in (("from", item.from_shaft), ("to", item.to_shaft)):
                if name is None:
                    yield Fault(("transmissions", k, key), what, allowed, "name the shaft")

    def _unplaced_motors(self) -> Iterator[Fault]:
        if self.motor is not None and self.motors:
            yield Fault(("motors",), "there is 'motor' and 'motors'", "one of them", "list all of them in motors")
        for k, item in enumerate(self.motors):
            for key in ("name", "shaft"):
                if key not in item.model_fields_set:
                    yield Fault(("motors", k, key), "this key is missing", "each motor of a list states it")

    @property
    def placed_motors(self) -> list[tuple[Location, MotorSection]]:
        """All motors and where they stand in this section."""
        single: list[tuple[Location, MotorSection]] = [] if self.motor is None else [(("motor",), self.motor)]
        return single + [(("motors", k), item) for k, item in enumerate(self.motors)]

    def build(self, channels: tuple[Channel, ...], controller: ControllerSection | None) -> Drive:
        """Return the drive; the controller of the file may stand in this section or beside it."""
        controller = controller or self.controller
        names = [shaft.name for shaft in self.shafts]
        chain = list(pairwise(names)) or [("", "")]
        return Drive(
            shafts=tuple(item.build() for item in self.shafts),
            transmissions=tuple(item.build(chain[min(k, len(chain) - 1)]) for k, item in enumerate(self.transmissions)),
            motors=tuple(item.build(names[0]) for _, item in self.placed_motors),
            controller=None if controller is None else controller.build(),
            channels=channels,
        )


class ClockSection(Section):
    offset: Number = 0.0
    drift: Number = 0.0

    def build(self, name: str) -> Clock:
        return Clock(name, **given(self, *self.keys()))


class ChannelSection(Section):
    measures: str
    role: Role | None = None
    gain: Number = 1.0
    offset: Number = 0.0
    delay: Number = 0.0
    resolution: Positive | None = None
    noise_std: Positive | None = None
    hold: Hold = "linear"
    eccentricity: EccentricityTerm = None
    clock: str = ""

    def build(self, name: str) -> Channel:
        """Return the channel; without a role it is an output, or an input where nothing could predict it."""
        part, _, signal = self.measures.partition(".")
        given_only = part in ("reference", "temperature") or signal in INPUT_ONLY
        return Channel(
            name=name,
            measures=self.measures,
            role=self.role or ("input" if given_only else "output"),
            **given(self, *(key for key in self.keys() if key not in ("measures", "role"))),
        )


class RecordingSection(Section):
    file: str
    begin: Finite | None = Field(None, alias="from")
    end: Finite | None = Field(None, alias="to")
    set: dict[str, Finite] = Field(default_factory=dict[str, float])

    @model_validator(mode="after")
    def _begins_before_it_ends(self) -> Self:
        if self.begin is not None and self.end is not None and self.begin >= self.end:
            what = f"the piece ends at {self.end:.15g} s and begins at {self.begin:.15g} s"
            raise refuse("recording", [Fault(("to",), what, "a time after `from`, s on the clock of the recording")])
        return self


def _read_recording_use(value: Any) -> RecordingSection:
    return RecordingSection.model_validate({"file": value} if isinstance(value, str) else value)


RecordingEntry = Annotated[Any, PlainValidator(_read_recording_use)]


class RecordingsSection(Section):
    train: list[RecordingEntry] = Field(min_length=1)
    validation: list[RecordingEntry] = Field(default_factory=list[RecordingSection])


class EstimationSection(Section):
    solver: Solver = "gauss_newton"
    fit: Fit | None = None
    segment: Annotated[int, Field(ge=1)] | None = None
    process_noise: dict[str, NoiseNumber] = Field(default_factory=dict[str, Any])
    loss: Loss = "squares"
    horizon_s: Positive | None = None
    initial_state: InitialState = "estimated"
    starts: Annotated[int, Field(ge=1)] = 1
    seed: Annotated[int, Field(ge=0)] = 0
    max_iterations: Annotated[int, Field(ge=1)] = 100
    max_step: Positive | None = None

    def build(self) -> EstimationOptions:
        stated = {
            name: item.guess if isinstance(item, GuessedLevel) else item for name, item in self.process_noise.items()
        }
        return EstimationOptions(
            **given(self, *(key for key in self.keys() if key != "process_noise")),
            process_noise={name: level for name, level in stated.items() if level is not None},
            estimated_noise=tuple(name for name, item in self.process_noise.items() if not isinstance(item, float)),
        )


class DiagnosisSection(Section):
    effects: Any = None
    exclude: Any = None
    significance: Any = None
    effort: Any = None
    samples: Any = None


class LimitsSection(Section):
    speed: Any = None
    torque: Any = None
    travel: Any = None


class ProblemSection(Section):
    """The whole file."""

    format: Literal["friction-ocp-problem/1"]
    title: str = ""
    drive: DriveSection
    channels: dict[ChannelName, ChannelSection]
    clocks: dict[PartName, ClockSection] = Field(default_factory=dict[str, ClockSection])
    controller: ControllerSection | None = None
    recordings: RecordingsSection
    estimation: EstimationSection = EstimationSection()
    constraints: list[str] = Field(default_factory=list[str])
    diagnosis: DiagnosisSection = DiagnosisSection()
    limits: LimitsSection = LimitsSection()

    @model_validator(mode="after")
    def _belongs_together(self) -> Self:
        faults: list[Fault] = []
        if self.controller is not None and self.drive.controller is not None:
            faults.append(
                Fault(("controller",), "there is another one in drive", "one controller", "remove one of them")
            )
        measured = {channel.measures for channel in self.channels.values()}
        controller = self.controller or self.drive.controller
        electrical = ("current", "current_command", "voltage")
        by_controller = controller is not None and controller.output != "torque"
        for location, motor in self.drive.placed_motors:
            electric = by_controller or measured & {f"{motor.name}.{name}" for name in electrical}
            if electric and "torque_constant" not in motor.model_fields_set:
                place = ("drive", *location, "torque_constant")
                faults.append(Fault(place, "this key is missing", NUMBER_FORMS, number=place))
        if faults:
            raise refuse("problem", faults)
        return self

    def build_drive(self) -> Drive:
        """Return the drive with its channels and its controller."""
        channels = tuple(item.build(name) for name, item in self.channels.items())
        clocks = tuple(item.build(name) for name, item in self.clocks.items())
        return replace(self.drive.build(channels, self.controller), clocks=clocks)

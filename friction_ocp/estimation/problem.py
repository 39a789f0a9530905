"""An identification problem: a drive, its recordings and how to fit them. Frozen; everything else reads it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from friction_ocp.drive.parts import Drive
from friction_ocp.recording.recording import Recording
from friction_ocp.recording.static_points import StaticPoints

Fit = Literal["simulation", "relaxed"]
Solver = Literal["gauss_newton", "ipopt"]
Loss = Literal["squares", "absolute", "huber", "student_t"]
InitialState = Literal["estimated", "measured"]


@dataclass(frozen=True)
class RecordingUse:
    """A recording and the numbers of the drive that are known but differ in it."""

    recording: Recording
    set: Mapping[str, float] = field(default_factory=dict[str, float])
    """Values by parameter path, in SI units."""
    place: str = ""
    """Where the problem file names it, such as recordings.train[0]."""
    moved: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    """By clock: offset, s, and drift that the stamps of its channels were relieved of."""
    original: Recording | None = None
    """The recording with its stamps as they were, where they were moved."""
    late: Mapping[str, float] = field(default_factory=dict[str, float])
    """By channel: the part of its delay, s, that is undone by reading its samples earlier."""

    @property
    def name(self) -> str:
        """Name of the recording in results."""
        return self.recording.name

    @property
    def file(self) -> str:
        """Name of the file that holds it, with which piece is meant where it is one."""
        return self.name if self.recording.path is None else self.name + self.recording.path.suffix


@dataclass(frozen=True)
class StaticUse:
    """Static points and the numbers of the drive that are known but differ in them."""

    points: StaticPoints
    set: Mapping[str, float] = field(default_factory=dict[str, float])
    """Values by parameter path, in SI units."""
    place: str = ""
    """Where the problem file names them."""

    @property
    def name(self) -> str:
        """Name of the points in results."""
        return self.points.name


SEGMENT = 50
"""Samples in a segment of the relaxed problem, usually."""


@dataclass(frozen=True)
class EstimationOptions:
    """How the fit is made; the defaults need no expert."""

    solver: Solver = "gauss_newton"
    fit: Fit | None = None
    """`simulation` fits the free run over the whole recording, `relaxed` short segments joined by process noise;
    None chooses: relaxed where a drive without feedback drifts under its measured input."""
    segment: int | None = None
    """Samples in a segment of the relaxed problem; None is SEGMENT, or fewer where torque noise moves a channel
    within."""
    process_noise: Mapping[str, float] = field(default_factory=dict[str, float])
    """Torque noise by shaft, N m/sqrt(Hz)."""
    estimated_noise: tuple[str, ...] = ()
    """Shafts whose torque noise is estimated; what `process_noise` says of them is a guess."""
    loss: Loss = "squares"
    horizon_s: float | None = None
    initial_state: InitialState = "estimated"
    starts: int = 1
    seed: int = 0
    max_iterations: int = 100
    max_step: float | None = None
    """Longest integrator step, s; None chooses it from the fastest mode of the drive."""

    @property
    def samples(self) -> int:
        """Samples in a segment of the relaxed problem."""
        return self.segment or SEGMENT


@dataclass(frozen=True)
class Problem:
    """What `check`, `simulate` and `identify` work on."""

    title: str
    drive: Drive
    train: tuple[RecordingUse, ...]
    validation: tuple[RecordingUse, ...] = ()
    static: tuple[StaticUse, ...] = ()
    """Static points that are fitted together with the training recordings, or alone."""
    static_validation: tuple[StaticUse, ...] = ()
    estimation: EstimationOptions = EstimationOptions()
    constraints: tuple[str, ...] = ()
    question: str = ""
    """The comment at the head of the problem file: what is asked and what is known."""
    path: Path | None = None
    text: str = ""
    """The file as it was read."""
    diagnosis: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Section `diagnosis` of the file: effects, exclude, significance, as far as stated."""
    limits: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Section `limits` of the file: speed, torque, travel, as far as stated."""

    @property
    def recordings(self) -> tuple[RecordingUse, ...]:
        """All recordings, training first."""
        return self.train + self.validation

    @property
    def fitted(self) -> tuple[RecordingUse | StaticUse, ...]:
        """All that is fitted: training recordings and static points."""
        return self.train + self.static

    @property
    def uses(self) -> tuple[RecordingUse | StaticUse, ...]:
        """All recordings and static points, those that are fitted first."""
        return self.fitted + self.validation + self.static_validation

"""Where a fit ended, as a file can hold it, and the program that it ended with."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from friction_ocp.estimation.clocks import Moves
from friction_ocp.estimation.division import cut_at, is_divided
from friction_ocp.estimation.gap import following
from friction_ocp.estimation.gauss_newton import Solution
from friction_ocp.estimation.horizon import is_relaxed
from friction_ocp.estimation.model import Model, laid_for, late_of, with_late, with_step
from friction_ocp.estimation.noise import NoiseLevel
from friction_ocp.estimation.noise_level import with_levels
from friction_ocp.estimation.preparation import joined_by_input_noise
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.rounds import Fitted, program_builder
from friction_ocp.estimation.synchronise import moves_of, with_moves
from friction_ocp.simulation.losses import Absolute, AbstractLoss, Huber, Squares, StudentT

LOSSES: Mapping[str, type[AbstractLoss]] = {loss.__name__: loss for loss in (Absolute, Huber, Squares, StudentT)}


@dataclass(frozen=True)
class Optimum:
    """The end of a fit."""

    solution: Solution
    loss: AbstractLoss
    max_step: float
    """Longest integrator step that it was found with, s."""
    noise_levels: tuple[NoiseLevel, ...] = ()
    """Torque noise that was estimated."""
    moves: Moves = dataclasses.field(default_factory=dict[str, dict[str, tuple[float, float]]])
    """By how much stamps were moved."""
    late: Mapping[str, Mapping[str, float]] = dataclasses.field(default_factory=dict[str, Mapping[str, float]])
    """By recording and channel: what reading samples earlier undoes of delays, s."""
    found: Mapping[str, float] = dataclasses.field(default_factory=dict[str, float])
    """Parameters that the gaps between segments are laid for, by name."""
    firsts: tuple[tuple[int, ...], ...] = ()
    """By recording the first nodes of its segments, where some were cut further than they were to begin with."""
    tells_noise: bool = False
    """Whether the noise of measured inputs is an unknown of every sample."""
    joins_noise: bool = False
    """Whether that noise joins segments."""

    @classmethod
    def of(cls, model: Model, fitted: Fitted) -> Optimum:
        """Take the end of a fit, and what of its model was settled on the way, without its program."""
        settled = (model.max_step, model.noise_levels, moves_of(model), late_of(model), model.found)
        joined = is_relaxed(model) and is_divided(model, fitted.program)
        firsts = [tuple(cut.first.tolist()) for cut in fitted.program.segments] if joined else ()
        return cls(fitted.solution, fitted.program.loss, *settled, tuple(firsts), model.tells_noise, model.joins_noise)

    def settled(self, model: Model) -> Model:
        """Return the model with the integrator steps, the torque noise and the stamps that the fit ended with."""
        model = joined_by_input_noise(model) if self.joins_noise else model
        moved = with_moves(with_levels(with_step(model, self.max_step), self.noise_levels), self.moves)
        told = {"tells_noise": self.tells_noise, "noisy_inputs": model.noisy_inputs if self.tells_noise else ()}
        return dataclasses.replace(laid_for(with_late(moved, self.late), self.found), **told)

    def fitted(self, model: Model) -> Fitted:
        """Return the fit with the program that it ended with: exact friction, the loss as it was; `model` settled."""
        program = program_builder(model)(model, 0.0, self.loss)
        if self.firsts:
            program = cut_at(model, program, [np.array(first, dtype=np.int64) for first in self.firsts])
        return Fitted(self.solution, following(model, program))

    def document(self) -> dict[str, Any]:
        """Return plain values; an objective that is not finite becomes None."""
        solution, objective = self.solution, self.solution.objective
        facts = {item.name: getattr(solution, item.name) for item in dataclasses.fields(solution)}
        return {
            **facts,
            "point": {
                "theta": solution.point.theta.tolist(),
                "nodes": [nodes.tolist() for nodes in solution.point.nodes],
            },
            "objective": float(objective) if np.isfinite(objective) else None,
            "max_step": self.max_step,
            "moves": {name: {clock: list(fast) for clock, fast in item.items()} for name, item in self.moves.items()},
            "late": {name: dict(item) for name, item in self.late.items()},
            "found": dict(self.found),
            "firsts": [list(first) for first in self.firsts],
            "tells_noise": self.tells_noise,
            "joins_noise": self.joins_noise,
            "noise_levels": [_plain(item) for item in self.noise_levels],
            "loss": {"name": type(self.loss).__name__, **dataclasses.asdict(self.loss)},  # pyright: ignore[reportArgumentType]
        }

    @classmethod
    def read(cls, content: Mapping[str, Any]) -> Optimum:
        """Return the optimum that `document` describes."""
        names = {item.name for item in dataclasses.fields(Solution)} - {"point", "objective"}
        facts = {key: value for key, value in content.items() if key in names}
        nodes = tuple(np.array(item, dtype=np.float64) for item in content["point"]["nodes"])
        point = Point(np.array(content["point"]["theta"], dtype=np.float64), nodes)
        objective = np.inf if content["objective"] is None else float(content["objective"])
        numbers = dict(content["loss"])
        loss = LOSSES[numbers.pop("name")](**numbers)
        levels = tuple(_level(item) for item in content["noise_levels"])
        moves = {
            name: {clock: (float(fast[0]), float(fast[1])) for clock, fast in item.items()}
            for name, item in content["moves"].items()
        }
        solution = Solution(point=point, objective=objective, **facts)
        late = {
            name: {channel: float(seconds) for channel, seconds in item.items()}
            for name, item in content["late"].items()
        }
        found = {name: float(value) for name, value in content["found"].items()}
        firsts = tuple(tuple(int(node) for node in first) for first in content["firsts"])
        told = {name: bool(content[name]) for name in ("tells_noise", "joins_noise")}
        return cls(solution, loss, float(content["max_step"]), levels, moves, late, found, firsts, **told)


def _plain(level: NoiseLevel) -> dict[str, Any]:
    """Return a level as plain values; what is not known becomes None."""
    known = level.verdict == "ok"
    told = {"std_error": level.std_error if known else None, "interval95": list(level.interval95) if known else None}
    return {**dataclasses.asdict(level), **told}


def _level(content: Mapping[str, Any]) -> NoiseLevel:
    """Return the level that `_plain` describes."""
    level = NoiseLevel(**content)
    if level.verdict != "ok":
        return dataclasses.replace(level, std_error=np.nan, interval95=(np.nan, np.nan))
    return dataclasses.replace(level, interval95=(float(level.interval95[0]), float(level.interval95[1])))

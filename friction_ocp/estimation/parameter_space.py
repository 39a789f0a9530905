"""The fitted parameters as one vector, and the numbers of the drive as functions of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca
import numpy as np

from friction_ocp.drive.mechanism import FEEDBACK_DELAY
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.estimation.problem import Problem, RecordingUse, StaticUse
from friction_ocp.expressions import parse, resolve_ties
from friction_ocp.parameters import Free, Leaf, Tie, is_off
from friction_ocp.simulation.grid import BoolArray, FloatArray

ROUNDING = 1e-9
"""Distance from a bound over that of the bounds, or over a parameter's size, at which a parameter is there."""


@dataclass(frozen=True)
class ParameterSpace:
    """Names, starts, bounds and priors of the fitted parameters; all arrays have one entry a parameter."""

    names: tuple[str, ...]
    """Paths; `path@recording` where a recording has its own value."""
    guess: FloatArray
    lower: FloatArray
    upper: FloatArray
    prior_mean: FloatArray
    prior_std: FloatArray
    """Infinite where there is no prior."""
    leaf_names: tuple[str, ...]
    """Every number of the drive, in the order of the model functions' `p`."""
    active: tuple[int, ...]
    """Indices into `leaf_names` of the numbers that depend on fitted parameters."""
    maps: Mapping[str, ca.Function]
    """By recording: parameters -> (numbers of the drive, derivative of the active ones)."""
    constraints: ca.Function | None
    """Parameters -> (values, Jacobian) of expressions that must be >= 0."""
    _latest: dict[str, tuple[bytes, FloatArray, FloatArray]] = field(
        init=False, compare=False, repr=False, default_factory=dict[str, tuple[bytes, FloatArray, FloatArray]]
    )
    """By recording the last answer of its map: a program asks for the same one several times."""

    @property
    def scale(self) -> FloatArray:
        """Typical size of each parameter, for scaling."""
        span = np.where(np.isfinite(self.upper - self.lower), self.upper - self.lower, 1.0)
        size = np.where(self.guess != 0, np.abs(self.guess), 0.05 * span)
        return np.where(np.isfinite(self.prior_std), np.minimum(size, 10 * self.prior_std), size)

    def prior_deviations(self, theta: FloatArray) -> FloatArray:
        """Return (parameters,) how far values are from the middle of their priors, in standard deviations."""
        return (theta - self.prior_mean) / self.prior_std

    def numbers(self, theta: FloatArray, recording: str) -> FloatArray:
        """Return all numbers of the drive for a recording."""
        return self.numbers_and_slope(theta, recording)[0]

    def numbers_and_slope(self, theta: FloatArray, recording: str) -> tuple[FloatArray, FloatArray]:
        """Return all numbers and (active, parameters) the derivative of the active ones; both read-only."""
        asked, known = theta.tobytes(), self._latest.get(recording)
        if known is None or known[0] != asked:
            numbers, slope = (np.asarray(value) for value in self.maps[recording](theta))
            known = self._latest[recording] = (asked, numbers.ravel(), slope)
            for array in known[1:]:
                array.flags.writeable = False
        return known[1], known[2]

    def numbers_by_path(self, theta: FloatArray, recording: str) -> dict[str, float]:
        """Return all numbers of the drive for a recording, by their paths."""
        return dict(zip(self.leaf_names, self.numbers(theta, recording).tolist(), strict=True))

    def with_known(self, known: Mapping[str, float]) -> FloatArray:
        """Return values that are known by name, and the guess of every other parameter."""
        return np.array([known.get(name, guess) for name, guess in zip(self.names, self.guess, strict=True)])

    def clip(self, theta: FloatArray) -> FloatArray:
        """Return the nearest point inside the bounds."""
        return np.clip(theta, self.lower, self.upper)

    def at_bounds(self, theta: FloatArray) -> BoolArray:
        """Return which parameters lie on one of their bounds, (parameters,)."""
        span = np.where(np.isfinite(self.upper - self.lower), self.upper - self.lower, np.abs(theta) + 1.0)
        return (theta - self.lower <= 1e-6 * span) | (self.upper - theta <= 1e-6 * span)

    def pressed(self, theta: FloatArray, slope: FloatArray) -> BoolArray:
        """Return which parameters, (parameters,), a falling objective presses against a bound on which they lie."""
        low, high = self.ends(theta)
        return (low & (slope > 0)) | (high & (slope < 0))

    def ends(self, theta: FloatArray) -> tuple[BoolArray, BoolArray]:
        """Return which parameters are at their lower and which at their upper bound but for rounding."""
        span = np.where(np.isfinite(self.upper - self.lower), self.upper - self.lower, self.scale)
        return theta - self.lower <= ROUNDING * span, self.upper - theta <= ROUNDING * span

    def moved(self, start: FloatArray) -> ParameterSpace:
        """Return the space with another start; priors and bounds stay."""
        return replace(self, guess=start)


def parameter_space(
    problem: Problem, leaf_names: Sequence[str], active: tuple[int, ...] | None = None
) -> ParameterSpace:
    """Collect the fitted parameters of a problem; `leaf_names` is the order of the model's numbers.

    `active` are the indices of the numbers whose derivatives the model gives; None finds them.
    """
    values = {leaf.path: leaf.value for leaf in drive_leaves(problem.drive)}
    free = {path: value for path, value in values.items() if isinstance(value, Free)}
    entries: list[tuple[str, Free]] = []
    for path, value in free.items():
        owners = [use.name for use in problem.fitted if path not in use.set] if value.scope == "recording" else [""]
        entries += [(f"{path}@{owner}" if owner else path, value) for owner in owners]
    names = tuple(name for name, _ in entries)
    theta = ca.SX.sym("theta", len(names))
    symbols = {name: theta[k] for k, name in enumerate(names)}
    tables = {use.name: _table(problem.drive, values, symbols, use) for use in problem.uses}
    leaf_vectors = {name: ca.vertcat(*[ca.SX(table[leaf]) for leaf in leaf_names]) for name, table in tables.items()}
    active = _active(leaf_vectors, theta) if active is None else active
    maps = {
        name: ca.Function(
            "numbers", [theta], [vector, ca.densify(ca.jacobian(ca.vertcat(*[vector[k] for k in active]), theta))]
        )
        for name, vector in leaf_vectors.items()
    }
    fields = {
        "guess": [value.guess for _, value in entries],
        "lower": [value.min for _, value in entries],
        "upper": [value.max for _, value in entries],
        "prior_mean": [value.centre for _, value in entries],
        "prior_std": [np.inf if value.prior_std is None else value.prior_std for _, value in entries],
    }
    return ParameterSpace(
        names=names,
        leaf_names=tuple(leaf_names),
        active=active,
        maps=maps,
        constraints=_constraints(problem, tables[problem.fitted[0].name], theta),
        **{key: np.asarray(column, dtype=float) for key, column in fields.items()},
    )


def _table(
    drive: Drive, values: Mapping[str, object], symbols: Mapping[str, ca.SX], use: RecordingUse | StaticUse
) -> dict[str, Any]:
    """Return every number of the drive in one recording: fixed, fitted or tied."""
    table: dict[str, Any] = {}
    ties: dict[str, str] = {}
    for path, value in values.items():
        if path in use.set:
            table[path] = use.set[path]
        elif isinstance(value, Free):
            table[path] = symbols.get(path, symbols.get(f"{path}@{use.name}", value.guess))
        elif isinstance(value, Tie):
            ties[path] = value.expr
        else:
            table[path] = value
    table |= {name: symbol for name, symbol in symbols.items() if name not in table}
    resolved = resolve_ties(ties, table)
    if drive.controller is not None and f"{drive.controller.feedback}.delay" in resolved:
        resolved[FEEDBACK_DELAY] = resolved[f"{drive.controller.feedback}.delay"]
    for motor in drive.delaying:
        if not is_off(motor.dead_time):  # a command that is acted on later is a drive that is seen later
            dead, resolved[f"{motor.name}.dead_time"] = resolved[f"{motor.name}.dead_time"], 0.0
            for channel in drive.outputs:
                resolved[f"{channel.name}.delay"] = resolved[f"{channel.name}.delay"] + dead
    if drive.recorded_late is not None:  # a drive that is seen earlier
        for channel in drive.outputs:
            resolved[f"{channel.name}.delay"] -= resolved[f"{drive.recorded_late.name}.delay"]
    if isinstance(use, RecordingUse):  # what is undone in the recording already is not the model's to do
        for channel, seconds in use.late.items():
            resolved[f"{channel}.delay"] = resolved[f"{channel}.delay"] - seconds
        for clock, gone in use.moved.items():
            for key, amount in zip(("offset", "drift"), gone, strict=True):
                resolved[f"clocks.{clock}.{key}"] = resolved[f"clocks.{clock}.{key}"] - amount
    return resolved


def nested_space(problem: Problem, space: ParameterSpace) -> ParameterSpace:
    """Return the space of the simpler model that is fitted first; the same space where there is none.

    Its friction has no Stribeck part, no curvature: what the fields of the laws declare as `nested`. A simpler model
    of which nothing would be left to fit is none.
    """
    leaves = {leaf.path: leaf for leaf in drive_leaves(problem.drive)}
    values = {path: leaf.value for path, leaf in leaves.items()}
    simpler = {
        path: _nested_value(leaf, values)
        for path, leaf in leaves.items()
        if leaf.nested is not None and isinstance(leaf.value, Free)
    }
    if not simpler:
        return space
    drive = bind_drive(problem.drive, values | simpler)
    simple = parameter_space(replace(problem, drive=drive, constraints=()), space.leaf_names, space.active)
    if not simple.names:
        return space
    start = dict(zip(space.names, space.guess, strict=True))
    return simple.moved(np.array([start[name] for name in simple.names]))


def _nested_value(leaf: Leaf, values: Mapping[str, object]) -> object:
    if not isinstance(leaf.nested, str):
        return leaf.nested
    if leaf.nested == "guess":
        return leaf.value.guess
    stem, _, _ = leaf.nested.rpartition(".")
    for path in (leaf.nested, stem, f"{leaf.nested}.positive"):
        if path in values:
            return Tie(path) if isinstance(values[path], (Free, Tie)) else values[path]
    return leaf.value.guess


def _active(vectors: Mapping[str, ca.SX], theta: ca.SX) -> tuple[int, ...]:
    moving: set[int] = set()
    for vector in vectors.values():
        rows, _ = ca.jacobian_sparsity(vector, theta).get_triplet()
        moving.update(rows)
    return tuple(sorted(moving))


def _constraints(problem: Problem, table: Mapping[str, object], theta: ca.SX) -> ca.Function | None:
    if not problem.constraints:
        return None
    margins = [
        parse(text, tuple(table), f"constraints[{k}]").evaluate(table) for k, text in enumerate(problem.constraints)
    ]
    stacked = ca.vertcat(*[ca.SX(margin) for margin in margins])
    return ca.Function("constraints", [theta], [stacked, ca.densify(ca.jacobian(stacked, theta))])

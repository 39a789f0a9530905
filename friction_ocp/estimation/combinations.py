"""What stays known of parameters that are traded for one another, spelled out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations as subsets

import numpy as np

from friction_ocp.estimation.foresight import Doubt, Survey, blind_directions
from friction_ocp.simulation.grid import FloatArray

NEGLIGIBLE = 0.03
"""Share of the leading parameter below which a term is not spelled."""
CLEAN = 0.05
"""Relative deviation from a known number within which a coefficient is taken for it."""
WELL_CHOSEN = 10.0
"""Condition number of the directions seen from the parameters that are solved for."""
EXPONENTS = (-2.0, -1.0, -0.5, 0.5, 1.0, 2.0)


@dataclass(frozen=True)
class Combination:
    """leading + sum of coefficient * other, or leading times powers of the others."""

    leading: str
    others: tuple[tuple[float, str], ...]
    """Coefficients of a sum, exponents of a product."""
    product: bool

    def text(self, known: Mapping[str, float]) -> str:
        """Spell the combination; coefficients that are powers of `known` numbers are written with these."""
        if self.product:
            return self.leading + "".join(_factor(power, name) for power, name in self.others)
        return self.leading + "".join(_term(coefficient, name, known) for coefficient, name in self.others)


def told(seen: Survey, doubt: Doubt) -> tuple[Combination, ...]:
    """Return the combinations of traded parameters that the recordings do tell.

    A change that leaves the recordings alone is a vector n; the combinations are the rows orthogonal to all n. Where
    over several views it is not the coefficients that stay but the relative ones, the combination is a product.
    """
    names = [seen.space.names[k] for k in doubt.members]
    views = sorted(seen.by_sight(doubt), key=lambda view: blind_directions(view.information, doubt.members).shape[1])
    directions = [blind_directions(view.information, doubt.members) for view in views]
    sizes = [view.sizes[list(doubt.members)] for view in views]
    solved = _solved_for(directions[0] / sizes[0][:, None])
    if not solved:
        return ()
    same = [k for k, found in enumerate(directions) if found.shape == directions[0].shape]
    relative = [_coefficients(directions[k] / sizes[k][:, None], solved) for k in same]
    rows = [k for k in range(len(names)) if k not in solved]
    values = np.array([views[k].point.theta[list(doubt.members)] for k in same])
    found: list[Combination] = []
    for row, leading in enumerate(rows):
        kept = [j for j in range(len(solved)) if abs(relative[0][row, j]) > NEGLIGIBLE]
        if not kept:
            continue
        logarithmic = np.array([[table[row, j] for j in kept] for table in relative])
        # a small change of a parameter over its signed value is that of its logarithm
        signs = np.sign(values[:, [leading]] * values[:, [solved[j] for j in kept]])
        sized = np.array([sizes[k] for k in same])
        plain = logarithmic * sized[:, [leading]] / sized[:, [solved[j] for j in kept]]
        found.append(_better(names, leading, [solved[j] for j in kept], logarithmic * signs, plain))
    return tuple(found)


def _better(
    names: Sequence[str], leading: int, others: Sequence[int], logarithmic: FloatArray, plain: FloatArray
) -> Combination:
    """Choose sum or product by what stays the same over the points."""
    powers = np.array([min(EXPONENTS, key=lambda p, value=value: abs(p - value)) for value in logarithmic[0]])
    steady = _spread(logarithmic) < 0.5 * _spread(plain) and np.all(np.abs(logarithmic - powers) < CLEAN)
    chosen = powers if steady else plain[0]
    terms = tuple((float(number), names[k]) for number, k in zip(chosen, others, strict=True))
    return Combination(names[leading], terms, bool(steady))


def _spread(rows: FloatArray) -> float:
    return float(np.max(np.std(rows, axis=0) / np.abs(np.mean(rows, axis=0))))


def _solved_for(relative: FloatArray) -> tuple[int, ...]:
    """Return as many members as there are directions, the last ones through which all directions are well seen."""
    count, directions = int(relative.shape[0]), int(relative.shape[1])
    if not 0 < directions < count:
        return ()
    scaled: FloatArray = relative / np.linalg.norm(relative, axis=0)
    backwards: list[int] = list(range(count - 1, -1, -1))
    choices = list(subsets(backwards, directions))
    condition = [float(np.linalg.cond(scaled[list(choice)])) for choice in choices]
    smallest = [float(np.min(np.linalg.norm(scaled[list(choice)], axis=1))) for choice in choices]
    for choice, cond, least in zip(choices, condition, smallest, strict=True):
        if cond < WELL_CHOSEN and least > 1.0 / WELL_CHOSEN:
            return choice
    return choices[int(np.argmin(condition))]


def _coefficients(relative: FloatArray, solved: Sequence[int]) -> FloatArray:
    """Return (rest, solved) a with (rest + a solved) unchanged along every direction."""
    rest = [k for k in range(relative.shape[0]) if k not in solved]
    return np.asarray(-np.linalg.solve(relative[list(solved)].T, relative[rest].T).T, dtype=np.float64)


def _term(coefficient: float, name: str, known: Mapping[str, float]) -> str:
    sign, size = "+" if coefficient > 0 else "-", abs(coefficient)
    candidates = {"": 1.0}
    for number in {*known.values()}:
        for power in (1, 2):
            candidates[f"{number**power:.6g}"] = number**power
    for text, number in candidates.items():
        if abs(size / number - 1.0) < CLEAN:
            return f" {sign} {text + ' * ' if text else ''}{name}"
        if abs(size * number - 1.0) < CLEAN:
            return f" {sign} {name} / {text}"
    return f" {sign} {size:.3g} * {name}"


def _factor(power: float, name: str) -> str:
    exponent = "" if abs(power) == 1 else f"**{abs(power):g}"
    return f" {'*' if power > 0 else '/'} {name}{exponent}"

"""The 27 certified nonlinear regressions of NIST's Statistical Reference Datasets, as programs for the solvers."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from smooth_programs import ToyProgram, toy

from friction_ocp.estimation.gauss_newton import Solution, Tolerances, solve_gauss_newton

CERTIFIED = Tolerances(decrease=1e-15, negligible=0.0, progress=0.0, stalled=1e-9, max_iterations=1000)
"""Six digits of parameters that the data hardly tell need steps far below a standard error, and no noise floor is
stated: only the relative decrease counts, down to where the sum of squares is rounded."""
DIGITS = 6.0
"""What NIST's users ask of the worst parameter."""
FOLDER = Path(__file__).with_name("nist_strd")

Formula = Callable[[Any, Any], Any]
"""(parameters, predictors) -> response; predictors are the columns behind the response."""


@dataclass(frozen=True)
class Certified:
    """One data set: formula and data, two starts, the certified answer."""

    name: str
    level: str
    """Lower, Average or Higher difficulty, as NIST calls it."""
    starts: tuple[tuple[float, ...], tuple[float, ...]]
    answer: np.ndarray
    std_error: np.ndarray
    residual_sum: float
    table: np.ndarray
    """(n, 1 + predictors): the response first."""

    def program(self, start: int) -> ToyProgram:
        """Return the sum of squares from start 1 or 2."""
        predictors = tuple(self.table[:, k] for k in range(1, self.table.shape[1]))
        response = np.log(self.table[:, 0]) if self.name == "Nelson" else self.table[:, 0]

        def residuals(theta: ca.SX) -> ca.SX:
            return FORMULAS[self.name](ca.vertsplit(theta), predictors) - ca.DM(response)

        return toy(residuals, self.starts[start - 1])

    def solve(self, start: int, tolerances: Tolerances = CERTIFIED) -> Solution:
        """Return where the solver of `identify` ends from start 1 or 2."""
        program: Any = self.program(start)
        with np.errstate(all="ignore"):
            return solve_gauss_newton(program, program.start, tolerances)

    def digits(self, theta: np.ndarray) -> float:
        """Return how many digits of the worst parameter agree with the certificate, at most its eleven."""
        error = np.max(np.abs(theta - self.answer) / np.abs(self.answer))
        return float(min(11.0, -np.log10(error))) if 0 < error < np.inf else (11.0 if error == 0 else -np.inf)


def read(name: str) -> Certified:
    """Read one data file."""
    text = (FOLDER / f"{name}.dat").read_text(encoding="ascii")
    rows = re.findall(r"^ +b\d+ = +(\S+) +(\S+) +(\S+) +(\S+) *$", text, re.MULTILINE)
    numbers = np.array(rows, dtype=float).T
    level, residual = re.search(r"(\w+) Level", text), re.search(r"Residual Sum of Squares: +(\S+)", text)
    first = int(re.search(r"Data +\(lines (\d+)", text)[1])  # type: ignore[index]
    table = np.array(
        [[float(word) for word in line.split()] for line in text.splitlines()[first - 1 :] if line.strip()]
    )
    assert level is not None and residual is not None
    return Certified(
        name, level[1], (tuple(numbers[0]), tuple(numbers[1])), numbers[2], numbers[3], float(residual[1]), table
    )


def _exponentials(b: Any, x: Any) -> Any:
    return b[0] * ca.exp(-b[1] * x[0]) + b[2] * ca.exp(-b[3] * x[0]) + b[4] * ca.exp(-b[5] * x[0])


def _peaks(b: Any, x: Any) -> Any:
    hills = sum(b[k] * ca.exp(-((x[0] - b[k + 1]) ** 2) / b[k + 2] ** 2) for k in (2, 5))
    return b[0] * ca.exp(-b[1] * x[0]) + hills


def _waves(b: Any, x: Any) -> Any:
    phases = ((12.0, b[1], b[2]), (b[3], b[4], b[5]), (b[6], b[7], b[8]))
    return b[0] + sum(c * ca.cos(2 * np.pi * x[0] / t) + s * ca.sin(2 * np.pi * x[0] / t) for t, c, s in phases)


def _cubics(b: Any, x: Any) -> Any:
    above = b[0] + b[1] * x[0] + b[2] * x[0] ** 2 + b[3] * x[0] ** 3
    return above / (1 + b[4] * x[0] + b[5] * x[0] ** 2 + b[6] * x[0] ** 3)


FORMULAS: Mapping[str, Formula] = {
    "Misra1a": lambda b, x: b[0] * (1 - ca.exp(-b[1] * x[0])),
    "Chwirut2": lambda b, x: ca.exp(-b[0] * x[0]) / (b[1] + b[2] * x[0]),
    "Chwirut1": lambda b, x: ca.exp(-b[0] * x[0]) / (b[1] + b[2] * x[0]),
    "Lanczos3": _exponentials,
    "Gauss1": _peaks,
    "Gauss2": _peaks,
    "DanWood": lambda b, x: b[0] * x[0] ** b[1],
    "Misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x[0] / 2) ** -2),
    "Kirby2": lambda b, x: (b[0] + b[1] * x[0] + b[2] * x[0] ** 2) / (1 + b[3] * x[0] + b[4] * x[0] ** 2),
    "Hahn1": _cubics,
    "Nelson": lambda b, x: b[0] - b[1] * x[0] * ca.exp(-b[2] * x[1]),
    "MGH17": lambda b, x: b[0] + b[1] * ca.exp(-x[0] * b[3]) + b[2] * ca.exp(-x[0] * b[4]),
    "Lanczos1": _exponentials,
    "Lanczos2": _exponentials,
    "Gauss3": _peaks,
    "Misra1c": lambda b, x: b[0] * (1 - (1 + 2 * b[1] * x[0]) ** -0.5),
    "Misra1d": lambda b, x: b[0] * b[1] * x[0] / (1 + b[1] * x[0]),
    "Roszman1": lambda b, x: b[0] - b[1] * x[0] - ca.atan(b[2] / (x[0] - b[3])) / np.pi,
    "ENSO": _waves,
    "MGH09": lambda b, x: b[0] * (x[0] ** 2 + x[0] * b[1]) / (x[0] ** 2 + x[0] * b[2] + b[3]),
    "Thurber": _cubics,
    "BoxBOD": lambda b, x: b[0] * (1 - ca.exp(-b[1] * x[0])),
    "Rat42": lambda b, x: b[0] / (1 + ca.exp(b[1] - b[2] * x[0])),
    "MGH10": lambda b, x: b[0] * ca.exp(b[1] / (x[0] + b[2])),
    "Eckerle4": lambda b, x: b[0] / b[1] * ca.exp(-0.5 * ((x[0] - b[2]) / b[1]) ** 2),
    "Rat43": lambda b, x: b[0] / (1 + ca.exp(b[1] - b[2] * x[0])) ** (1 / b[3]),
    "Bennett5": lambda b, x: b[0] * (b[1] + x[0]) ** (-1 / b[2]),
}
"""By data set, in NIST's order of difficulty."""

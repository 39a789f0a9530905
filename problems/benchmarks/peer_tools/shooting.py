"""What tools built on CasADi share: the step of a case as a function, and the answer that every peer returns."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from peer_cases import Case, FloatArray, Run, bristle_rate


@dataclass(frozen=True)
class Answer:
    """What a tool found."""

    values: FloatArray
    """(parameters,)."""
    build: float
    """Seconds until it could solve, compilation included."""
    seconds: float
    """Seconds of the solution."""
    converged: bool
    note: str = ""


def step_function(case: Case) -> ca.Function:
    """Return (x, u, h, p over its scale) -> x after a sample: Runge-Kutta, or implicit in the bristle."""
    x, u = ca.SX.sym("x", case.state_scale.size), ca.SX.sym("u", case.runs[0].inputs.shape[1])
    p, h = ca.SX.sym("p", case.guess.size), ca.SX.sym("h")
    now, inputs, values = x, ca.vertsplit(u), ca.vertsplit(p * case.scale)
    for _ in range(case.substeps):
        one = bristle_step if case.stiff else runge_kutta_step
        now = one(case, now, inputs, values, h / case.substeps)
    return ca.Function("advance", [x, u, h, p], [now], ["x", "u", "h", "p"], ["xf"])


def runge_kutta_step(case: Case, x: Any, u: Sequence[Any], p: Sequence[Any], h: Any) -> Any:
    """Return one step of order four."""

    def slope(at: Any) -> Any:
        return ca.vertcat(*case.equations(ca.vertsplit(at), u, p, ca))

    first = slope(x)
    second = slope(x + 0.5 * h * first)
    third = slope(x + 0.5 * h * second)
    return x + h / 6.0 * (first + 2.0 * second + 2.0 * third + slope(x + h * third))


def bristle_step(case: Case, x: Any, u: Sequence[Any], p: Sequence[Any], h: Any) -> Any:
    """Return one midpoint step; the bristle, state 2, forgets implicitly, so that no speed makes it unstable."""
    middle = x
    for reach in (0.5 * h, h):
        rate = bristle_rate(middle[1], p, ca)
        after = (x[2] * (1.0 - 0.5 * h * rate) + h * middle[1]) / (1.0 + 0.5 * h * rate)
        at = [middle[0], middle[1], 0.5 * (x[2] + after), middle[3], middle[4]]
        middle = x + reach * ca.vertcat(*case.equations(at, u, p, ca))
    return middle


def output_function(case: Case) -> ca.Function:
    """Return (x, u, p over its scale) -> outputs over their noise."""
    x, p = ca.SX.sym("x", case.state_scale.size), ca.SX.sym("p", case.guess.size)
    u = ca.SX.sym("u", case.runs[0].inputs.shape[1])
    values = case.outputs(ca.vertsplit(x), ca.vertsplit(u), ca.vertsplit(p * case.scale), ca)
    return ca.Function("seen", [x, u, p], [ca.vertcat(*values) / case.noise], ["x", "u", "p"], ["y"])


def segment_function(case: Case, samples: int) -> ca.Function:
    """Return (x, U, H, Y, p) -> state behind the last sample, errors of all samples before it over their noise."""
    step, seen = step_function(case), output_function(case)
    x, p = ca.MX.sym("x", case.state_scale.size), ca.MX.sym("p", case.guess.size)
    inputs, spans = ca.MX.sym("U", case.runs[0].inputs.shape[1], samples), ca.MX.sym("H", 1, samples)
    measured = ca.MX.sym("Y", case.noise.size, samples)
    after = step.mapaccum(samples)(x, inputs, spans, p)
    states = ca.horzcat(x, after[:, :-1])
    errors = seen.map(samples)(states, inputs, p) - measured
    return ca.Function("segment", [x, inputs, spans, measured, p], [after[:, -1], ca.vec(errors)])


def segments_of(case: Case, run: Run, samples: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return start states (nx, count), and U, H, Y of all segments side by side, what does not fill one left out."""
    count = (run.time.size - 1) // samples
    kept = count * samples
    spans = np.diff(run.time)[:kept][None]
    return run.states[:kept:samples].T, run.inputs[:kept].T, spans, (run.measured[:kept] / case.noise).T


def compiled(function: ca.Function) -> ca.Function:
    """Return a function as native code, by the compiler of this machine."""
    folder = Path(tempfile.mkdtemp())
    function.generate(f"{function.name()}.c", {"with_header": False})
    source = Path(f"{function.name()}.c").replace(folder / "function.c")
    library = folder / "function.so"
    subprocess.run(["cc", "-O2", "-fPIC", "-shared", str(source), "-o", str(library), "-lm"], check=True)
    return ca.external(function.name(), str(library))

"""Profile likelihood: what the recordings exclude, one parameter at a time, without assuming a parabola."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.estimate import Estimate, ParameterEstimate
from friction_ocp.estimation.influence import influence
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.uncertainty import uncertainty
from friction_ocp.execution.linear_algebra import with_one_thread
from friction_ocp.execution.task import Outcome, Task
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.answer import Answer, answer
from friction_ocp.statistics.execution import Execution
from friction_ocp.statistics.misfit import mean_weight, plain_covariance
from friction_ocp.statistics.walk import STEPS_TO_THRESHOLD, Aim, walk_side

BETTER = 0.1
"""Fall of the scaled likelihood ratio below the optimum that is worth a warning."""
NARROW = 0.5
"""Width of a likelihood interval over that of the standard error below which it is doubted."""
WIDEST_FIRST_STEP = 0.1
"""Over the range between the bounds."""
SIDES: tuple[Literal[-1, 1], ...] = (-1, 1)

Word = Literal["finite", "one_sided", "flat"]


@dataclass(frozen=True)
class Profile:
    """The profile of one parameter."""

    parameter: ParameterEstimate
    verdict: Word
    interval: tuple[float | None, float | None]
    """Where the profile meets the threshold; None where it does not."""
    ends: tuple[str, str]
    """What ended each side: threshold, bound, far, points, solver, or failed."""
    scale: float
    """Sandwich variance over inverse information: 1 for white residuals."""
    values: FloatArray
    """(n,) rising, the estimate among them."""
    ratios: FloatArray
    """(n,) twice the rise of the objective over `scale`."""
    thetas: FloatArray
    """(n, parameters) where the others go."""
    converged: tuple[bool, ...]


@dataclass(frozen=True)
class Profiles:
    """The profiles of an identification."""

    estimate: Estimate
    threshold: float
    """Scaled likelihood ratio at the ends of the intervals."""
    items: tuple[Profile, ...]
    warnings: tuple[str, ...]


@with_one_thread
def profile(problem: Problem, parameters: Sequence[str] = (), execution: Execution = Execution()) -> Profiles:
    """Fit a problem and profile its likelihood along each fitted parameter, or along those named.

    With psi held and the others optimal, twice the rise of the objective is compared with the 95 % point of chi2 with
    one degree of freedom. That holds for white residuals of the stated noise. Elsewhere the objective is a working
    likelihood, whose ratio is inflated by the sandwich variance of psi over that of the inverse Hessian: it is divided
    by that (`mean_weight`) and compared with the squared t quantile of the sandwich, so that for a parabola the
    interval is that of `identify`. Priors count as data.
    """
    found = answer(problem, execution)
    names = [item.name for item in found.estimate.parameters]
    unknown = [name for name in parameters if name not in names]
    if unknown:
        allowed = f"fitted are {', '.join(names)}"
        raise FrictionOcpError([Finding("profile", f"'{name}' is not fitted", allowed) for name in unknown])
    chosen = [k for k, name in enumerate(names) if not parameters or name in parameters]
    threshold = found.estimate.uncertainty.reach**2
    aims = _aims(found, threshold)
    tasks = [
        Task(f"{names[k]}.{'up' if side > 0 else 'down'}", walk_side, (replace(aims[k], direction=side),))
        for k in chosen
        for side in SIDES
    ]
    outcomes = execution.run("sides of profiles", tasks, found.workshop)
    items = tuple(_profile(found, k, aims[k], outcomes) for k in chosen)
    return Profiles(found.estimate, threshold, items, _warnings(items, outcomes))


def _aims(found: Answer, threshold: float) -> list[Aim]:
    """Return for every parameter its scale, first step and tangent; a parameter at its bound as if it had none."""
    space, doubt = found.workshop.model.space, found.estimate.uncertainty
    theta = found.workshop.fitted.solution.point.theta
    free = replace(space, lower=np.full(theta.size, -np.inf), upper=np.full(theta.size, np.inf))
    seen = influence(found.workshop.fitted.program, found.workshop.fitted.solution.point)
    opened = uncertainty(free, theta, seen, doubt.kind == "gauss_newton", found.workshop.problem.estimation.loss)
    aims: list[Aim] = []
    for k in range(theta.size):
        kept = ~doubt.at_bound
        sure = opened if doubt.at_bound[k] else doubt
        kept[k] = True
        inside = int(np.sum(kept[:k]))
        plain = plain_covariance(doubt, kept)
        tangent = np.zeros(theta.size)
        tangent[kept] = plain[:, inside] / plain[inside, inside]
        scale = mean_weight(sure, [k], kept)
        step = float(np.sqrt(threshold)) * float(sure.std_error[k]) / STEPS_TO_THRESHOLD
        widest = WIDEST_FIRST_STEP * min(space.upper[k] - space.lower[k], 10.0 * space.scale[k])
        aims.append(Aim(k, 1, scale, threshold, min(step, float(widest)), tuple(tangent.tolist())))
    return aims


def _profile(found: Answer, k: int, aim: Aim, outcomes: Mapping[str, Outcome]) -> Profile:
    parameter = found.estimate.parameters[k]
    down, up = (_side(outcomes[f"{parameter.name}.{word}"]) for word in ("down", "up"))
    optimum = found.workshop.fitted.solution.point.theta
    here = {"value": parameter.value, "ratio": 0.0, "theta": optimum.tolist(), "converged": True}
    points: list[Mapping[str, Any]] = [*down["points"], here, *up["points"]]
    interval = (down["crossing"], up["crossing"])
    return Profile(
        parameter=parameter,
        verdict=_verdict(interval),
        interval=interval,
        ends=(down["end"], up["end"]),
        scale=aim.scale,
        values=np.array([point["value"] for point in points]),
        ratios=np.array([point["ratio"] for point in points]),
        thetas=np.array([point["theta"] for point in points]),
        converged=tuple(bool(point["converged"]) for point in points),
    )


def _side(outcome: Outcome) -> Mapping[str, Any]:
    if outcome.value is None:
        return {"points": [], "crossing": None, "end": "failed"}
    return outcome.value


def _is_narrow(item: Profile) -> bool:
    low, high = item.interval
    wald = item.parameter.interval95
    return low is not None and high is not None and high - low < NARROW * (wald[1] - wald[0])


def _verdict(interval: tuple[float | None, float | None]) -> Word:
    told = sum(end is not None for end in interval)
    return "finite" if told == 2 else "one_sided" if told else "flat"


def _warnings(items: Sequence[Profile], outcomes: Mapping[str, Outcome]) -> tuple[str, ...]:
    texts = [f"The side {key} failed: {outcome.error}." for key, outcome in outcomes.items() if outcome.error]
    lowest = min(items, key=lambda item: float(np.min(item.ratios)))
    if float(np.min(lowest.ratios)) < -BETTER:
        at = lowest.values[int(np.argmin(lowest.ratios))]
        texts.append(
            f"The profile of {lowest.parameter.name} falls below the optimum at {at:.6g} {lowest.parameter.unit}: the "
            "fit ended in a local one, and the intervals are about that. Run multistart, or start from there."
        )
    texts += [
        f"{item.parameter.name}: its likelihood interval is less than half as wide as that of its standard error. The "
        "objective is rough there, or fits with it held stopped early: trust the wider one."
        for item in items
        if _is_narrow(item)
    ]
    for item in items:
        stopped = [end for end in item.ends if end in ("points", "solver")]
        if stopped:
            texts.append(f"{item.parameter.name}: the profile stopped before the threshold ({', '.join(stopped)}).")
        missed = sum(not ok for ok in item.converged)
        if missed:
            texts.append(f"{item.parameter.name}: the solver did not converge at {missed} points of the profile.")
    return tuple(texts)

"""Minimise the likelihood of a model on a footing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from friction_ocp.diagnosis.excerpts import excerpts
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.footing import Footing
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.model import Model, in_time
from friction_ocp.estimation.node_ends import MOST_TURNS, WARM, begun
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.stages import relaxed
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares

COARSE = Tolerances(decrease=1e-3, progress=1e-2, max_iterations=12)
QUICK = Tolerances(decrease=1e-4, negligible=0.1, progress=1e-3, max_iterations=10)


def polished(
    model: Model,
    foot: Footing,
    theta: FloatArray,
    nodes: tuple[FloatArray, ...] | None,
    limits: Tolerances = WARM,
) -> FittedModel:
    """Minimise the likelihood on the footing from a start."""
    program = foot.training(model)
    theta = model.space.clip(theta)
    point = begun(program, theta) if nodes is None else Point(theta, nodes)
    if not theta.size:
        return FittedModel(model, foot, linear_program(program, solve_nodes(program, point)))
    end = solve_gauss_newton(program, point, limits)
    return FittedModel(model, foot, linear_program(program, end.point))


def loosely_joined(model: Model, starts: Sequence[FloatArray]) -> tuple[Program, Point]:
    """Return segments joined by gaps that any error of the model may take, and the best point from some parameters.

    Free runs over whole recordings have many ends, most of them far from the best; on loosely joined segments the way
    is short, and leads near it.
    """
    program = relaxed(model, excerpts(model), 0.0, Squares())
    ends = [solve_gauss_newton(program, suggested_point(program, theta), COARSE) for theta in starts]
    return program, min(ends, key=lambda end: end.objective).point


def loosely(model: Model, values: Mapping[str, float]) -> FloatArray:
    """Return the parameters that are best on loosely joined segments, from some values."""
    return loosely_joined(model, [model.space.clip(model.space.with_known(values))])[1].theta


def timed(fitted: FittedModel, limits: Tolerances = WARM) -> FittedModel:
    """Fit again with late channels read as late as they were found to be, until no delay of a whole sample is left."""
    for _ in range(MOST_TURNS):
        nearer = in_time(fitted.model, fitted.theta)
        if nearer is fitted.model:
            break
        fitted = polished(nearer, fitted.footing, fitted.theta, fitted.linear.point.nodes, limits)
    return fitted

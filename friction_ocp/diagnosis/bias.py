"""Which fitted parameters stood in for what was missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.drive.units import unit_of
from friction_ocp.drive.values import drive_leaves
from friction_ocp.estimation.uncertainty import inverse_information
from friction_ocp.simulation.grid import FloatArray

REACH = 1.96


@dataclass(frozen=True)
class Bias:
    """A parameter before and after the additions."""

    name: str
    before: float
    after: float
    unit: str
    interval95: tuple[float, float]
    """Of the value after."""


def biased_parameters(base: FittedModel, final: FittedModel) -> tuple[Bias, ...]:
    """Return the parameters of the base model whose value before lies outside the interval of the value after."""
    if final is base:
        return ()
    errors = dict(zip(final.model.space.names, standard_errors(final), strict=True))
    drive = base.model.problem.drive
    units = {leaf.path: unit_of(leaf, drive) for leaf in drive_leaves(drive)}
    before, after = base.values, final.values
    found: list[Bias] = []
    for name in before:
        if name not in after:
            continue
        reach = REACH * float(errors[name])
        if abs(before[name] - after[name]) > reach:
            interval = (after[name] - reach, after[name] + reach)
            found.append(Bias(name, before[name], after[name], units[name.partition("@")[0]], interval))
    return tuple(found)


def standard_errors(fitted: FittedModel) -> FloatArray:
    """Return the standard errors of all parameters, robust against residuals that are correlated within blocks."""
    rows = fitted.linear.rows
    scores = fitted.blocks.sums(rows.jacobian * rows.residual[:, None])
    hessian = rows.jacobian.T @ rows.jacobian
    told, untold = inverse_information(hessian)
    count = len(scores)
    centred = (scores - scores.mean(axis=0)) * np.sqrt(count / max(count - 1, 1))
    robust = told @ (centred.T @ centred) @ told
    return np.sqrt(np.maximum(np.diag(robust), np.diag(told)) + np.diag(untold))

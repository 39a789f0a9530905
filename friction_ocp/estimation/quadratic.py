"""The small quadratic program of a step: parameters within bounds and linearised constraints."""

from __future__ import annotations

import casadi as ca
import numpy as np

from friction_ocp.simulation.grid import FloatArray

ROUNDING = 1e-12
"""Distance to a bound over that between both, or over the way to the only one, below which a step ends on it."""


def linear_constraints(constraints: ca.Function | None, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return A (constraints, parameters) and b: margins are b + A d to first order, and may not turn negative."""
    if constraints is None:
        return np.zeros((0, theta.size)), np.zeros(0)
    margins, rows = constraints(theta)
    return np.asarray(rows).reshape(-1, theta.size), np.asarray(margins).ravel()


def bounded_step(
    hessian: FloatArray,
    gradient: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    rows: FloatArray,
    margins: FloatArray,
) -> FloatArray:
    """Minimise 1/2 d'Hd + g'd subject to lower <= d <= upper and margins + rows d >= 0.

    Dual active-set method on the scaled problem. Source: Goldfarb & Idnani 1983. d = 0 need not be feasible.
    """
    scale = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    matrix = hessian * np.outer(scale, scale)
    matrix[np.diag_indices_from(matrix)] += 1e-12
    inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    free = -inverse @ (gradient * scale)
    if _is_within(scale * free, lower, upper, rows, margins):
        return scale * free
    count = gradient.size
    normals = [np.diag(scale)[np.isfinite(lower)], -np.diag(scale)[np.isfinite(upper)], rows * scale]
    offsets = [lower[np.isfinite(lower)], -upper[np.isfinite(upper)], -margins]
    a, b = np.concatenate(normals).reshape(-1, count), np.concatenate(offsets)
    sizes = np.maximum(np.linalg.norm(a, axis=1), 1e-300)
    step = scale * _dual_active_set(inverse, free, a / sizes[:, None], b / sizes)
    low, high = (ROUNDING * _distance(bound, upper - lower) for bound in (lower, upper))
    return np.where(step - lower <= low, lower, np.where(upper - step <= high, upper, step))


def _distance(bound: FloatArray, span: FloatArray) -> FloatArray:
    """Return how far apart both bounds are, or how far away the only one is; 0 where there is no bound."""
    alone = np.where(np.isfinite(bound), np.abs(bound), 0.0)
    return np.where(np.isfinite(span), span, alone)


def _is_within(step: FloatArray, lower: FloatArray, upper: FloatArray, rows: FloatArray, margins: FloatArray) -> bool:
    return bool(np.all(step >= lower) and np.all(step <= upper) and np.all(margins + rows @ step >= 0.0))


def _dual_active_set(inverse: FloatArray, x: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Move x, which minimises 1/2 x'hx + g'x, until a x >= b, rows of a normalised; `inverse` is that of h."""
    active: list[int] = []
    multipliers = np.zeros(0)
    for _ in range(50 + 10 * len(b)):
        slack = a @ x - b
        slack[active] = 0.0
        worst = int(np.argmin(slack)) if slack.size else -1
        if worst < 0 or slack[worst] > -1e-10 * (1.0 + abs(float(b[worst]))):
            return x
        x, active, multipliers = _add_constraint(inverse, a, b, x, active, multipliers, worst)
    return x


def _add_constraint(
    inverse: FloatArray,
    a: FloatArray,
    b: FloatArray,
    x: FloatArray,
    active: list[int],
    multipliers: FloatArray,
    new: int,
) -> tuple[FloatArray, list[int], FloatArray]:
    """Move until constraint `new` holds, dropping constraints whose multiplier would turn negative."""
    own = 0.0
    for _ in range(2 * len(b) + 2):
        n = a[active]
        towards: FloatArray = inverse @ a[new]
        reaction, direction = np.zeros(0), towards
        if active:
            gram = n @ inverse @ n.T
            reaction = np.asarray(np.linalg.lstsq(gram, n @ towards, rcond=None)[0], dtype=np.float64)
            direction = towards - inverse @ n.T @ reaction
        rate = float(a[new] @ direction)
        full = (b[new] - float(a[new] @ x)) / rate if rate > 1e-14 else np.inf
        blocked = [(multipliers[k] / reaction[k], k) for k in range(len(active)) if reaction[k] > 1e-14]
        partial, drop = min(blocked, default=(np.inf, -1))
        length = min(full, partial)
        if not np.isfinite(length):
            return x, active, multipliers
        x = x + length * direction if np.isfinite(full) else x
        multipliers, own = multipliers - length * reaction, own + length
        if full <= partial:
            return x, [*active, new], np.append(multipliers, own)
        active, multipliers = active[:drop] + active[drop + 1 :], np.delete(multipliers, drop)
    return x, active, multipliers

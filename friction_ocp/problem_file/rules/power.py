"""Whether a recorded effort and a recorded motion can belong to a passive machine, or only with the opposite sign."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.optimize as _optimize  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.problem_file.rules.case import Motion
from friction_ocp.recording.recording import FloatArray

optimize: Any = _optimize  # its own types are incomplete

_MOST_SAMPLES = 4000


def sign_of_work(motion: Motion, time: FloatArray, effort: FloatArray, heavy: Sequence[Motion] = ()) -> int:
    """Return 1 where the work of `effort` (torque, force, current or voltage) fits only with the sign that it has.

    -1 where it fits only with its sign turned round, 0 where neither is the case. The work is fitted by what a body
    takes up: kinetic energy, Coulomb and viscous losses, all with factors >= 0, and the potential energy of the shafts
    whose motion is in `heavy`, with any factor.
    """
    with np.errstate(all="ignore"):  # absurd values come out as not finite
        return _sign_of_work(motion, time, effort, heavy)


def _sign_of_work(motion: Motion, time: FloatArray, effort: FloatArray, heavy: Sequence[Motion]) -> int:
    present = np.isfinite(effort)
    if np.count_nonzero(present) < 5:
        return 0
    applied = np.interp(motion.time, time[present], effort[present])
    work = _integral(motion.time, applied * motion.omega)
    terms = [
        0.5 * (motion.omega**2 - motion.omega[0] ** 2),
        _integral(motion.time, motion.omega**2),
        _integral(motion.time, np.abs(motion.omega)),
    ]
    for angle in (seen.theta for seen in heavy if seen.theta is not None and seen.theta.size == motion.omega.size):
        for potential in (np.cos(angle) - np.cos(angle[0]), np.sin(angle) - np.sin(angle[0])):
            terms += [potential, -potential]
    every = max(1, work.size // _MOST_SAMPLES)
    columns = np.column_stack(terms)[::every]
    straight, turned = (_misfit(columns, sign * work[::every]) for sign in (1.0, -1.0))
    best, other = min(straight, turned), max(straight, turned)
    return 0 if best >= 0.5 or best >= 0.5 * other else (1 if straight < turned else -1)


def _integral(time: FloatArray, rate: FloatArray) -> FloatArray:
    return np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))))


def _misfit(columns: FloatArray, work: FloatArray) -> float:
    """Return the residual of the fit with factors >= 0 as a share of the work; 1 where there is nothing to fit."""
    size = float(np.linalg.norm(work))
    scales = np.linalg.norm(columns, axis=0)
    used = columns[:, scales > 0] / scales[scales > 0]
    if size == 0.0 or not np.isfinite(size) or not used.size or not np.all(np.isfinite(used)):
        return 1.0
    try:
        _, residual = optimize.nnls(used, work / size)
    except RuntimeError:  # no convergence
        return 1.0
    return float(residual)

"""Linear regressions as the statistics see them: Jacobian, residuals, bounds and priors without any drive."""

from __future__ import annotations

import numpy as np
import scipy.signal

from friction_ocp.estimation.influence import Influence
from friction_ocp.estimation.parameter_space import ParameterSpace


def space(
    guess: np.ndarray,
    lower: np.ndarray | float = -np.inf,
    upper: np.ndarray | float = np.inf,
    prior_std: np.ndarray | float = np.inf,
) -> ParameterSpace:
    """Return parameters a, b, c, ... with their bounds; priors are centred on the guess."""
    guess = np.asarray(guess, dtype=float)
    return ParameterSpace(
        names=tuple("abcdefgh"[: guess.size]),
        guess=guess,
        lower=np.broadcast_to(np.asarray(lower, dtype=float), guess.shape),
        upper=np.broadcast_to(np.asarray(upper, dtype=float), guess.shape),
        prior_mean=guess,
        prior_std=np.broadcast_to(np.asarray(prior_std, dtype=float), guess.shape),
        leaf_names=(),
        active=(),
        maps={},
        constraints=None,
    )


def regression(
    jacobian: np.ndarray,
    noise: np.ndarray,
    score: np.ndarray | None = None,
    prior_std: np.ndarray | float = np.inf,
    recordings: int = 1,
    window: np.ndarray | None = None,
) -> Influence:
    """Return the influence of residuals `noise` of unit floor; `score` is rho'(r) where it is not r itself."""
    rows, parameters = jacobian.shape
    pull = np.broadcast_to(np.asarray(prior_std, dtype=float), (parameters,)) ** -2.0
    return Influence(
        jacobian=jacobian,
        residual=noise,
        score_weight=noise if score is None else score,
        curvature=np.ones(rows),
        channel=np.zeros(rows, dtype=np.int64),
        recording=np.sort(np.arange(rows) % recordings),
        window=np.zeros(rows, dtype=np.int64) if window is None else window,
        time=0.01 * np.arange(rows),
        prior=np.diag(pull),
    )


def autoregressive(phi: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return count samples of unit variance, each phi times the one before plus white noise."""
    steps = rng.standard_normal(count) * np.sqrt(1.0 - phi**2)
    steps[0] /= np.sqrt(1.0 - phi**2)
    return np.asarray(scipy.signal.lfilter([1.0], [1.0, -phi], steps))

"""How far likelihood ratios are inflated where residuals are not white noise of the stated size."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_ocp.estimation.uncertainty import Uncertainty, inverse_information
from friction_ocp.simulation.grid import BoolArray, FloatArray


def plain_covariance(doubt: Uncertainty, free: BoolArray) -> FloatArray:
    """Return the inverse information of the free parameters, as if residuals were white."""
    told, untold = inverse_information(doubt.information[np.ix_(free, free)])
    return told + untold


def mean_weight(doubt: Uncertainty, psi: Sequence[int], free: BoolArray) -> float:
    """Return by what twice the rise of the objective is divided before it is compared with chi2 of q = len(psi).

    With psi held and the other free parameters optimal it tends to a weighted sum of chi2(1), the weights being the
    eigenvalues of (H^-1)_psi^-1 V_psi with the sandwich covariance V; this is their mean, 1 for white residuals.
    Source: Kent 1982; Rotnitzky & Jewell 1990; Varin, Reid & Firth 2011, section 2.3.
    """
    chosen = [int(np.sum(free[:k])) for k in psi if free[k]]
    if doubt.kind == "gauss_newton" or not chosen:
        return 1.0
    place = np.ix_(chosen, chosen)
    robust = doubt.covariance[np.ix_(free, free)][place]
    return max(float(np.trace(np.linalg.solve(plain_covariance(doubt, free)[place], robust))) / len(chosen), 1e-300)

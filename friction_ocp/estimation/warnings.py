"""What is wrong with an answer, in sentences that stand above it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from friction_ocp.estimation.gauss_newton import Solution
from friction_ocp.estimation.identifiability import Verdict
from friction_ocp.estimation.score import Errors
from friction_ocp.estimation.uncertainty import Uncertainty
from friction_ocp.estimation.whiteness import Whiteness

VALIDATION_EXCESS = 1.5
"""Validation error over training error from which a warning says that the fit does not carry over."""
WHAT_TO_DO = (
    "diagnose says what the model lacks. Where that is noise, of a torque or of a measured input, state "
    "estimation: {process_noise: {SHAFT: estimate}}, or noise_std at the input."
)

LOST_FREE_RUN = (
    "Noise of a measured input moves free runs over whole recordings by more than the sensors err, so that no fit to "
    "these is a good one. The values are those of short segments that such noise joins, which leave no more than noise."
)


class NamedVerdict(Protocol):
    """A parameter with its verdict."""

    @property
    def name(self) -> str: ...
    @property
    def value(self) -> float: ...
    @property
    def unit(self) -> str: ...
    @property
    def verdict(self) -> Verdict: ...


class Scored(Protocol):
    """Free-run errors on training and validation recordings."""

    @property
    def train_errors(self) -> Mapping[str, tuple[Errors, Mapping[str, Errors]]]: ...
    @property
    def validation_errors(self) -> Mapping[str, tuple[Errors, Mapping[str, Errors]]]: ...


def warnings_of(
    solution: Solution,
    parameters: Sequence[NamedVerdict],
    doubt: Uncertainty,
    residuals: Mapping[str, Mapping[str, Whiteness]],
    scored: Scored,
    drifts: Mapping[str, float] | None = None,
) -> tuple[str, ...]:
    """Return every reason to doubt the answer, the gravest first.

    `drifts` says by channel how far, over its noise floor, noise of measured inputs moves the free run.
    """
    texts: list[str] = []
    if not solution.converged:
        texts.append(
            f"The solver did not converge: {solution.message}. The values below are its last iterate, which has no "
            "standard errors."
        )
    texts += [_parameter_warning(item) for item in parameters if item.verdict.word not in ("ok", "traded")]
    texts += _trade_warnings([item for item in parameters if item.verdict.word == "traded"])
    texts += _misfit_warnings(doubt, residuals, scored, solution.converged, drifts or {})
    return tuple(texts)


def _parameter_warning(item: NamedVerdict) -> str:
    shown = _shown(item)
    if item.verdict.word == "at_bound":
        return f"{shown} lies on its bound: widen the bound, or the model asks the parameter for something else."
    if item.verdict.traded_with:
        return (
            f"{shown}: the recordings do not tell this parameter; what would tell it from "
            f"{', '.join(item.verdict.traded_with)} is a motion faster than half their sampling rate; log faster."
        )
    return f"{shown}: the recordings do not tell this parameter; fix it, give a prior, or record what shows it."


def _shown(item: NamedVerdict) -> str:
    return f"{item.name} = {item.value:.4g} {'' if item.unit == '1' else item.unit}".rstrip()


def _trade_warnings(traded: Sequence[NamedVerdict]) -> list[str]:
    """Say once of every group of parameters that trade with one another that they do."""
    groups: dict[frozenset[str], list[NamedVerdict]] = {}
    for item in traded:
        groups.setdefault(frozenset((item.name, *item.verdict.traded_with)), []).append(item)
    texts: list[str] = []
    for names, members in groups.items():
        own = [item.name for item in members]
        others = sorted(names - set(own))
        what = ", ".join(_shown(item) for item in members)
        against = "one another" if len(own) > 1 else ""
        partners = " and ".join(part for part in (against, ", ".join(others)) if part)
        verb = "is" if len(own) == 1 else "are"
        texts.append(
            f"{what} {verb} traded with {partners}: only a combination of them is known; "
            "fix one, give a prior, or record what tells them apart."
        )
    return texts


def _misfit_warnings(
    doubt: Uncertainty,
    residuals: Mapping[str, Mapping[str, Whiteness]],
    scored: Scored,
    converged: bool,
    drifts: Mapping[str, float],
) -> list[str]:
    texts: list[str] = []
    coloured = sum(not test.white for tests in residuals.values() for test in tests.values())
    total = sum(len(tests) for tests in residuals.values())
    if coloured:
        robust = f", and the standard errors are the robust ({doubt.kind}) ones" if converged else ""
        texts.append(
            f"Residuals are not white in {coloured} of {total} recorded channels: the model misses something{robust}."
        )
    for name, (errors, _) in scored.validation_errors.items():
        train = scored.train_errors[name][0]
        drift = drifts.get(name, 0.0)
        unavoidable = float(np.hypot(1.0, drift)) * errors.rms / errors.noise_ratio if drift else 0.0
        if errors.rms > VALIDATION_EXCESS * max(train.rms, unavoidable):
            texts.append(
                f"{name}: the free run is {errors.rms / train.rms:.1f} times worse on validation than on training."
            )
    far = False
    for name, (errors, _) in scored.train_errors.items():
        drift = drifts.get(name, 0.0)
        ratio = errors.noise_ratio / float(np.hypot(1.0, drift))
        if ratio > 2.0:
            what = "what noise of its inputs makes of it" if drift > 1.0 else "the noise floor"
            texts.append(f"{name}: the error of the free run is {ratio:.{0 if ratio >= 100 else 1}f} times {what}.")
            far = True
    return [*texts, *([WHAT_TO_DO] if far and not drifts else [])]

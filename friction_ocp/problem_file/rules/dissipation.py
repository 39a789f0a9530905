"""Rules about friction that can give energy back: warnings with the inequality and the speeds for which it holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from friction_ocp.errors import Finding
from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.gms import GeneralizedMaxwellSlip
from friction_ocp.friction.law import AbstractFrictionLaw, Direction
from friction_ocp.parameters import Free
from friction_ocp.problem_file.rules.case import Case, Rule
from friction_ocp.quantities import si_unit
from friction_ocp.recording.recording import FloatArray

SPEEDS: FloatArray = np.concatenate(([0.0], np.geomspace(1e-12, 1e9, 4201)))
"""Where an inequality is looked at, rad/s or m/s: two hundred speeds a decade."""
_DIRECTIONS: tuple[Direction, ...] = ("positive", "negative")


def friction_opposes_motion(case: Case) -> Iterator[Finding]:
    """Friction that pushes is doubtful: its magnitude is not negative."""
    for where, unit, law, _ in _laws(case):
        with np.errstate(all="ignore"):
            magnitude = np.asarray(law.magnitude(SPEEDS), dtype=np.float64)
        wrong = magnitude < 0.0
        if np.any(wrong):
            worst = SPEEDS[wrong][0]
            holds = _range(wrong, lambda speed, law=law: float(law.magnitude(speed)) >= 0.0, unit)
            what = f"law '{law.name}' pushes from {worst:.4g} {unit} on: its torque at speeds >= 0 becomes negative"
            yield Finding(where, what, f"torque >= 0, {holds}", "keep to these speeds", severity="warning")


def bristles_are_passive(case: Case) -> Iterator[Finding]:
    """A LuGre model that can give energy back is doubtful. Source: Barahanov & Ortega 2000."""
    for where, unit, law, guessed in _laws(case):
        if not isinstance(law, LuGre):
            continue
        tau_c, tau_s, sigma1, sigma2 = law.tau_c, law.tau_s, law.sigma1, law.sigma2
        limit = sigma1 * (tau_s - tau_c) / tau_c if tau_c > 0 else 0.0
        if sigma1 > 0 and sigma2 <= limit and tau_s > tau_c:
            wrong = _margin(law, SPEEDS) < 0.0
            holds = _range(wrong, lambda speed, law=law: float(_margin(law, np.array([speed]))[0]) >= 0.0, unit)
            at = " at the guesses" if guessed else ""
            what = f"sigma2 = {sigma2:g} is not above sigma1 (tau_s - tau_c)/tau_c = {limit:g}{at}"
            allowed = (
                f"a LuGre model with sigma2 > sigma1 (tau_s - tau_c)/tau_c is passive at all speeds, this one {holds}"
            )
            remedy = "guess a lower sigma1, or state that as a constraint" if guessed else "lower sigma1"
            yield Finding(where, what, allowed, f"{remedy}, or keep to these speeds", severity="warning")


def _margin(law: LuGre, speed: FloatArray) -> FloatArray:
    r"""Return the least dissipation at `speed` over all deflections that the bristle can have, per speed squared.

    With the storage sigma0 z^2 / 2 and s = sigma0 z / g the dissipated power over omega^2 is
    sigma1 + sigma2 - sigma1 s + s^2 g / omega, and s is at most tau_s / g.
    """
    with np.errstate(all="ignore"):
        level = np.maximum(np.asarray(law.level(speed), dtype=np.float64), 1e-300)
        speed = np.maximum(speed, 1e-300)
        deflected = np.minimum(0.5 * law.sigma1 * speed / level, law.tau_s / level)
        return np.nan_to_num(law.sigma1 + law.sigma2 - law.sigma1 * deflected + deflected**2 * level / speed)


def _range(wrong: np.ndarray, holds: Callable[[float], bool], unit: str) -> str:
    """Return the speeds from standstill up to the first one at which an inequality fails."""
    first = int(np.argmax(wrong))
    if not np.any(wrong):
        return "at all speeds"
    if first == 0:
        return "at no speed"
    low, high = float(SPEEDS[first - 1]), float(SPEEDS[first])
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return f"for |omega| <= {low:.4g} {unit}"


def maxwell_shares_add_up(case: Case) -> Iterator[Finding]:
    """The elements of a Maxwell-slip law share its level: not negative, and all of it."""
    for where, _, law, _ in _laws(case):
        if not isinstance(law, GeneralizedMaxwellSlip):
            continue
        shares = [float(item.share) for item in law.elements]
        if min(shares) < 0:
            yield Finding(where, f"an element has the share {min(shares):g}", "shares are not negative")
        elif abs(sum(shares) - 1.0) > 1e-6:
            what = f"the shares of the elements sum to {sum(shares):.6g}: steady friction is that multiple of its level"
            remedy = "tie the last share: {expr: 1 - ...}"
            yield Finding(where, what, "shares that sum to 1", remedy, severity="warning")


def hysteresis_has_a_jump(case: Case) -> Iterator[Finding]:
    """A polyline with a loop at standstill has no line through zero beside it."""
    for k, shaft in enumerate(case.bound.shafts):
        line = getattr(shaft.friction.law, "polyline", None)
        if line is not None and line.omega_zero is not None:
            where = case.at(f"drive.shafts[{k}].friction.polyline.omega_zero")
            yield Finding(where, "the loop and the line through zero exclude each other", remedy="remove omega_zero")


def _laws(case: Case) -> Iterator[tuple[str, str, AbstractFrictionLaw, bool]]:
    """Yield of every shaft, once for each direction that differs: place, unit of speed, law, whether it is guessed."""
    for k, shaft in enumerate(case.bound.shafts):
        element: FrictionElement = shaft.friction
        own = (leaf.value for path, leaf in case.leaves.items() if path.startswith(f"{shaft.name}.friction."))
        guessed = any(isinstance(value, Free) for value in own)
        for law in dict.fromkeys(element.law.along(direction) for direction in _DIRECTIONS):
            yield case.at(f"drive.shafts[{k}].friction"), si_unit("speed", shaft.motion), law, guessed


DISSIPATION: tuple[Rule, ...] = (
    friction_opposes_motion,
    bristles_are_passive,
    maxwell_shares_add_up,
    hysteresis_has_a_jump,
)

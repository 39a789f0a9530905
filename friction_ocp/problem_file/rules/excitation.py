"""Rules about what the recordings excite: what they cannot tell apart is doubtful before any fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from friction_ocp.drive.parts import Shaft
from friction_ocp.errors import Finding
from friction_ocp.parameters import Free
from friction_ocp.problem_file.rules.case import Case, Motion, Rule, quantity_text
from friction_ocp.quantities import si_unit
from friction_ocp.recording.recording import FloatArray

_REVERSAL_SHARE = 0.05
"""Share of the greatest speed that counts as motion in a direction."""
_SLOW = 2.0
"""Stribeck speeds below which friction has not yet fallen to the Coulomb friction."""
_BENT = 2.0
"""Steady deflections of the bristles within which their bending is seen."""
_FEW_SAMPLES = 20
"""Fewer samples than these say little about a curve."""
_LITTLE_TRAVEL = 0.3
"""rad; sin(theta) is then a straight line within 1.5 %."""


def something_is_fitted(case: Case) -> Iterator[Finding]:
    """An identification has at least one parameter with a guess."""
    if not any(isinstance(leaf.value, Free) for leaf in case.leaves.values()):
        what = "nothing to fit: every number is known"
        yield Finding(case.at("drive"), what, "a parameter with {guess: ...} is fitted", severity="warning")


def friction_is_seen_in_both_directions(case: Case) -> Iterator[Finding]:
    """Without a reversal Coulomb friction is a constant torque."""
    for k, shaft in enumerate(case.drive.shafts):
        speeds = _speeds(case, shaft)
        if not _is_fitted(case, f"{shaft.name}.friction.tau_c") or speeds is None:
            continue
        moving = _REVERSAL_SHARE * float(np.max(np.abs(speeds)))
        if not (np.max(speeds) > moving and np.min(speeds) < -moving):
            what = f"'{shaft.name}' never reverses in training: Coulomb friction cannot be told from a constant offset"
            where = case.at(f"drive.shafts[{k}].friction.tau_c")
            yield Finding(where, what, remedy="record motion in both directions", severity="warning")


def speeds_reach_the_breaks(case: Case) -> Iterator[Finding]:
    """A slope beyond the greatest speed is not seen."""
    for shaft, bound in zip(case.drive.shafts, case.bound.shafts, strict=True):
        speeds = _speeds(case, shaft)
        stem = f"{shaft.name}.friction.breaks."
        if speeds is None or not hasattr(bound.friction.law, "breaks"):
            continue
        fastest, unit = float(np.max(np.abs(speeds))), si_unit("speed", shaft.motion)
        for path in (path for path in case.numbers if path.startswith(stem)):
            if case.numbers[path] > fastest:
                knee = quantity_text(case.numbers[path], unit)
                what = f"break {knee} is above the greatest speed in training, {quantity_text(fastest, unit)}"
                remedy = "record faster motion or leave the break out"
                yield Finding(case.at(case.place(path)), what, remedy=remedy, severity="warning")


def speeds_go_below_the_stribeck_speed(case: Case) -> Iterator[Finding]:
    """Friction that falls with speed is seen only where the shaft moves slowly."""
    for shaft in case.drive.shafts:
        speeds = _speeds(case, shaft)
        stem = f"{shaft.name}.friction.omega_s"
        if speeds is None or not (_is_fitted(case, stem) or _is_fitted(case, f"{shaft.name}.friction.tau_s")):
            continue
        for path in (path for path in case.numbers if path == stem or path.startswith(f"{stem}.")):
            slow = int(np.count_nonzero(np.abs(speeds) < _SLOW * case.numbers[path]))
            if slow < _FEW_SAMPLES:
                what = (
                    f"'{shaft.name}' moves below {_SLOW:g} times the Stribeck speed of "
                    f"{quantity_text(case.numbers[path], si_unit('speed', shaft.motion))} in {slow} training samples"
                )
                remedy = "record slow motion or leave the Stribeck part out"
                yield Finding(case.at(case.place(path)), what, f"at least {_FEW_SAMPLES}", remedy, severity="warning")


def reversals_show_presliding(case: Case) -> Iterator[Finding]:
    """The stiffness of bristles is seen only while they bend: in the first steps after a reversal or a stop."""
    for shaft, bound in zip(case.drive.shafts, case.bound.shafts, strict=True):
        law = bound.friction.law
        if not law.has_bristle or not _is_fitted(case, f"{shaft.name}.friction.sigma0"):
            continue
        path = next(path for path in case.numbers if path.startswith(f"{shaft.name}.friction.sigma0"))
        force = [number for name, number in case.numbers.items() if name.startswith(f"{shaft.name}.friction.tau_c")]
        motions = _motions(case, shaft)
        if not motions or not force or not case.numbers[path] > 0:
            continue
        bend = _BENT * max(force) / case.numbers[path]
        seen = sum(_samples_after_reversals(motion, bend) for motion in motions)
        if seen < _FEW_SAMPLES:
            distance = quantity_text(float(f"{bend:.3g}"), si_unit("angle", shaft.motion))
            what = f"'{shaft.name}' is within {distance} after a reversal in {seen} training samples"
            remedy = "record reversals or stops with more samples, or fix sigma0"
            yield Finding(case.at(case.place(path)), what, f"at least {_FEW_SAMPLES}", remedy, severity="warning")


def periods_are_travelled(case: Case) -> Iterator[Finding]:
    """What repeats over an angle is told from friction and load only where the shaft travels a whole period."""
    motors = {motor.name: motor.shaft for motor in case.drive.motors}
    for path in (path for path in case.numbers if path.endswith(".period")):
        owner = path.partition(".")[0]
        shaft = next((item for item in case.drive.shafts if item.name == motors.get(owner, owner)), None)
        if shaft is None or case.leaves[path].kind != "angle" or not _is_fitted(case, path.removesuffix(".period")):
            continue
        angles = [motion.theta for motion in _motions(case, shaft) if motion.theta is not None]
        travel = max((float(np.ptp(angle)) for angle in angles), default=np.inf)
        if travel < case.numbers[path]:
            unit = si_unit("angle", shaft.motion)
            what = f"'{shaft.name}' travels {quantity_text(float(f'{travel:.3g}'), unit)} in training"
            allowed = f"more than a period, {quantity_text(case.numbers[path], unit)}"
            yield Finding(case.at(case.place(path)), what, allowed, "record more travel", severity="warning")


def gravity_is_seen_at_several_angles(case: Case) -> Iterator[Finding]:
    """Over a small angle gravity is a straight line: torque and phase trade."""
    for k, shaft in enumerate(case.drive.shafts):
        fitted = all(_is_fitted(case, f"{shaft.name}.gravity.{key}") for key in ("torque", "phase"))
        angles = [motion.theta for motion in _motions(case, shaft) if motion.theta is not None]
        if not fitted or not angles:
            continue
        travel = max(float(np.max(angle)) for angle in angles) - min(float(np.min(angle)) for angle in angles)
        if travel < _LITTLE_TRAVEL:
            what = (
                f"'{shaft.name}' travels {travel:.3g} rad in training: torque and phase of gravity cannot be told apart"
            )
            where = case.at(f"drive.shafts[{k}].gravity")
            yield Finding(where, what, f"more than {_LITTLE_TRAVEL:g} rad", "record more travel", severity="warning")


def _samples_after_reversals(motion: Motion, distance: float) -> int:
    """Return how many samples lie within a distance of the last reversal, these themselves left out."""
    theta = motion.theta if motion.theta is not None else np.cumsum(motion.omega * np.gradient(motion.time))
    turned = np.append(False, np.diff(np.sign(motion.omega)) != 0)
    last = np.maximum.accumulate(np.where(turned, np.arange(theta.size), -1))
    near = (last >= 0) & ~turned & (np.abs(theta - theta[last]) < distance)
    return int(np.count_nonzero(near))


def _is_fitted(case: Case, path: str) -> bool:
    return any(
        isinstance(leaf.value, Free)
        for name, leaf in case.leaves.items()
        if name == path or name.startswith(f"{path}.")
    )


def _motions(case: Case, shaft: Shaft) -> Sequence[Motion]:
    seen = (case.motion(shaft.name, use) for use in case.problem.train)
    return [motion for motion in seen if motion is not None]


def _speeds(case: Case, shaft: Shaft) -> FloatArray | None:
    """Return all speeds of a shaft in training, None where no channel sees it."""
    speeds = [motion.omega for motion in _motions(case, shaft)]
    return np.concatenate(speeds) if speeds else None


FIT: tuple[Rule, ...] = (something_is_fitted,)
EXCITATION: tuple[Rule, ...] = (
    friction_is_seen_in_both_directions,
    speeds_reach_the_breaks,
    speeds_go_below_the_stribeck_speed,
    reversals_show_presliding,
    periods_are_travelled,
    gravity_is_seen_at_several_angles,
)

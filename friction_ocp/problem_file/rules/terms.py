"""Rules about optional terms: what they need to be there, and where they can act."""

from __future__ import annotations

import math
from collections.abc import Iterator

from friction_ocp.drive.inputs import warm_up_faults
from friction_ocp.drive.live_terms import live_terms
from friction_ocp.drive.units import SHAFT_SIGNALS
from friction_ocp.drive.values import drive_leaves
from friction_ocp.errors import Finding
from friction_ocp.problem_file.rules.case import Case, Rule


def warm_up_has_what_it_needs(case: Case) -> Iterator[Finding]:
    """Friction that follows a temperature needs it measured; one that settles needs a time to settle in."""
    for finding in warm_up_faults(case.drive):
        shaft, _, key = finding.where.partition(".")
        k = [item.name for item in case.drive.shafts].index(shaft)
        yield Finding(case.at(f"drive.shafts[{k}].{key}"), finding.what, finding.allowed, finding.remedy)


def further_waves_have_periods(case: Case) -> Iterator[Finding]:
    """A wave beside that of `period` has a period of its own, and is none without an amplitude."""
    parts = ("other_cosine", "other_sine")
    for stem in dict.fromkeys(path.rpartition(".")[0] for path in case.numbers if ".other_" in path):
        there = [key for key in (*parts, "other_period", "other_origin") if f"{stem}.{key}" in case.numbers]
        waves, periodic = there[0] in parts, "other_period" in there
        if waves and periodic:
            continue
        missing = "other_cosine or other_sine" if periodic else "other_period"
        where = case.at(case.place(f"{stem}.{there[0]}"))
        yield Finding(where, f"a further wave without {missing}", remedy=f"state {missing}, too, or leave it out")


def ripples_leave_friction(case: Case) -> Iterator[Finding]:
    """Friction that varies by more than itself would drive the shaft somewhere."""
    for k, shaft in enumerate(case.bound.shafts):
        ripple = shaft.friction.ripple
        size = 0.0 if ripple is None else math.hypot(ripple.cosine, ripple.sine)
        if size > 1.0:
            what = f"the ripple, {size:.3g} of the friction, is more than all of it"
            where = case.at(f"drive.shafts[{k}].friction.ripple")
            yield Finding(where, what, "at most 1; what is negative counts as 0", severity="warning")


def eccentric_sensors_see_angles(case: Case) -> Iterator[Finding]:
    """Only an output channel of a rotary shaft has an error that repeats every turn."""
    motions = {shaft.name: shaft.motion for shaft in case.drive.shafts}
    for channel in case.drive.channels:
        rotary = motions.get(channel.part) == "rotary" and channel.signal in SHAFT_SIGNALS
        if channel.eccentricity is None or (rotary and channel.role == "output"):
            continue
        where = case.at(f"channels.{channel.name}.eccentricity")
        what = f"{channel.role} channel that measures {channel.measures}"
        yield Finding(where, what, "outputs that measure theta, omega or alpha of a rotary shaft", "leave it out")


def settings_have_an_effect(case: Case) -> Iterator[Finding]:
    """What is zero in the drive is left out of the model, so that a recording cannot set it to something else."""
    live = {leaf.path for leaf in drive_leaves(live_terms(case.drive))}
    for place, use in case.uses():
        for path in use.set:
            if path in case.leaves and path not in live:
                what = f"'{path}' is left out of the model, its term being zero"
                remedy = "give the term a value or a guess in the drive that is not a plain 0"
                yield Finding(case.at(f"{place}.set"), what, remedy=remedy)


TERMS: tuple[Rule, ...] = (ripples_leave_friction, eccentric_sensors_see_angles, settings_have_an_effect)
WHOLE: tuple[Rule, ...] = (warm_up_has_what_it_needs, further_waves_have_periods)
"""Rules about what has to be there."""

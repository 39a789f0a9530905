"""Rules about static points: whether the drive can have the steady states that they state."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from friction_ocp.drive.steady import reference_shaft
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import StaticUse
from friction_ocp.estimation.static_points import scatter_of
from friction_ocp.problem_file.rules.case import Case, Rule
from friction_ocp.quantities import si_unit


def static_points_are_of_this_drive(case: Case) -> Iterator[Finding]:
    """The speed is that of the shaft of the first motor, and a current needs a motor."""
    for where, use in _uses(case):
        motion = case.drive.shaft(reference_shaft(case.drive)).motion
        expected, found = si_unit("speed", motion), use.points.units["speed"]
        if found != expected:
            what = f"/speed is in {found}, but shaft '{reference_shaft(case.drive)}' turns in {expected}"
            yield Finding(where, what, f"a unit that converts to {expected}")
        if use.points.torque is None and not case.drive.motors:
            yield Finding(where, "there is a /current, and the drive has no motor", "/torque, or a motor in drive")
        elif use.points.torque is None and case.numbers[f"{case.drive.motors[0].name}.torque_constant"] == 1.0:
            what = "the points are currents, and the torque constant is 1 N m/A"
            yield Finding(where, what, remedy="state drive.motor.torque_constant", severity="warning")


def static_points_have_a_scatter(case: Case) -> Iterator[Finding]:
    """Each point has a standard error, stated or to be had from its neighbours."""
    for where, use in _uses(case):
        stated = use.points.std_error
        if stated is not None and not bool(np.all(stated > 0)):
            yield Finding(where, "a standard error is not positive", "/std_error > 0 at every point")
            continue
        try:
            scatter_of(use.points, case.drive)
        except FrictionOcpError as error:
            yield from (Finding(where, item.what, item.allowed) for item in error.findings)


def static_points_see_gravity(case: Case) -> Iterator[Finding]:
    """Gravity depends on the angle."""
    heavy = [shaft.name for shaft in case.drive.shafts if shaft.gravity is not None]
    for where, use in _uses(case):
        if heavy and use.points.position is None:
            what = f"there is no /position, so that the gravity of '{heavy[0]}' counts as that at angle 0"
            yield Finding(where, what, remedy="state /position", severity="warning")


def _uses(case: Case) -> Iterator[tuple[str, StaticUse]]:
    for place, use in case.static_uses():
        yield case.at(f"{place}: {use.points.path or use.name}"), use


STATIC: tuple[Rule, ...] = (
    static_points_are_of_this_drive,
    static_points_have_a_scatter,
    static_points_see_gravity,
)

"""A design as the document that result.json holds."""

from __future__ import annotations

from typing import Any

from friction_ocp.drive.units import signal_unit, unit_of
from friction_ocp.drive.values import drive_leaves
from friction_ocp.excitation.design import Design, Option
from friction_ocp.quantities import si_unit
from friction_ocp.result_document import heading, number, provenance

FORMAT = "friction-ocp-design/1"
RECORDING = "excitation.h5"


def design_document(design: Design) -> dict[str, Any]:
    """Return the content of result.json for a design."""
    names = design.fitted.model.space.names
    drive = design.problem.drive
    units = {leaf.path: unit_of(leaf, drive) for leaf in drive_leaves(drive)}
    return {
        "format": FORMAT,
        "status": "designed" if design.options else "nothing_possible",
        **heading(design.problem),
        "criterion": design.criterion,
        "separates": [{"effect": effect, "component": place} for effect, place in design.between],
        "limits": {key: getattr(design.limits, key) for key in ("speed", "torque", "travel")},
        "limit_units": {
            key: si_unit(kind, drive.shafts[0].motion)
            for key, kind in (("speed", "speed"), ("torque", "torque"), ("travel", "angle"))
        },
        "limits_stated": list(design.limits.stated),
        "channel_units": {item.name: signal_unit(drive, item.measures) for item in drive.channels},
        "recording": RECORDING if design.options else None,
        "options": [_option(design, item) for item in design.options],
        "parameters": {
            name: {
                "value": float(value),
                "unit": units.get(name.partition("@")[0], ""),
                "std_error_before": number(float(error)),
            }
            for name, value, error in zip(names, design.fitted.theta, design.std_errors, strict=True)
        },
        "provenance": provenance(
            design.problem,
            "design",
            {"criterion": design.criterion, "between": [list(pair) for pair in design.between]},
        ),
    }


def _option(design: Design, option: Option) -> dict[str, Any]:
    names = design.fitted.model.space.names
    errors = option.std_errors
    return {
        "motion": option.run.motion.name,
        "sentence": option.run.motion.sentence,
        "amplitude": option.run.amplitude,
        "peaks": {key: number(value) for key, value in option.run.peaks.items()},
        "worth": number(option.worth),
        "power": option.power,
        "std_errors": None if errors is None else {n: number(float(e)) for n, e in zip(names, errors, strict=True)},
    }

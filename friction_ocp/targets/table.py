"""Friction over speed as a table: comma-separated values with a 95 % band."""

from __future__ import annotations

import csv
import io
from typing import Any, cast

import numpy as np

from friction_ocp.estimation.curves import friction_curves
from friction_ocp.estimation.uncertainty import reach95
from friction_ocp.quantities import si_unit
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.targets.fitted import Fitted, result_document

COLUMNS = ("shaft", "load", "load_unit", "speed", "speed_unit", "torque", "lower95", "upper95", "torque_unit")


def table_text(fitted: Fitted) -> str:
    """Return the friction of every shaft over the speeds of the recordings, one row a speed."""
    model, theta = fitted.model, fitted.model.space.guess
    covariance, reach, known = _covariance(fitted)
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(COLUMNS)
    for curve in friction_curves(model, theta, covariance, reach, fitted.simulation.train):
        motion = fitted.drive.shaft(curve.shaft).motion
        speed_unit, torque_unit = si_unit("speed", motion), si_unit("torque", motion)
        for k, speed in enumerate(curve.speed):
            band = [_number(curve.lower[k]), _number(curve.upper[k])] if known else ["", ""]
            row = (curve.shaft, _number(curve.load), torque_unit, _number(speed), speed_unit, _number(curve.torque[k]))
            writer.writerow([*row, *band, torque_unit])
    return lines.getvalue()


def _number(value: float) -> str:
    return f"{float(value):.9g}"


def _covariance(fitted: Fitted) -> tuple[FloatArray, float, bool]:
    """Return the covariance in result.json, standard errors in half an interval, and whether it is of these parameters.

    Zeros where there is none.
    """
    names = fitted.model.space.names
    stated = result_document(fitted).get("covariance")
    none = np.zeros((len(names), len(names)))
    if not isinstance(stated, dict):
        return none, 0.0, False
    content = cast(dict[str, Any], stated)
    if tuple(content.get("names", ())) != names:
        return none, 0.0, False
    freedom = content.get("freedom")
    reach = reach95(np.inf if freedom is None else float(freedom))
    values = [[np.nan if item is None else float(item) for item in row] for row in content["matrix"]]
    matrix = np.array(values, dtype=np.float64)
    return (matrix, reach, True) if matrix.shape == none.shape else (none, 0.0, False)

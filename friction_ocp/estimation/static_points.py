"""Static points as residuals of a fit: the constant-speed reduction of the drive against what was averaged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import casadi as ca
import numpy as np

from friction_ocp.drive.parts import Drive
from friction_ocp.drive.steady import Effort, steady_drive
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.problem import StaticUse
from friction_ocp.recording.static_points import StaticPoints
from friction_ocp.simulation.grid import FloatArray

FEWEST = 5
"""Points from which their scatter can be had from the differences between neighbours."""
CHI_SQUARE_MEDIAN = 0.4549
"""Median of a squared standard normal number: a few kinks of the curve do not count."""
STANDSTILL = 1e-9
"""Speed over the greatest one that stands for breakaway, in the direction that the point states."""


@dataclass(frozen=True)
class StaticTerm:
    """The residuals of one set of static points."""

    name: str
    effort: Effort
    speed: FloatArray
    """(n,) signed."""
    measured: FloatArray
    """(n,) torque or current, signed."""
    std_error: FloatArray
    """(n,)."""
    noise_source: str
    unit: str
    predict_and_slope: ca.Function
    """Numbers of the drive -> (n,) effort, (n, active) its derivative."""

    def predict(self, space: ParameterSpace, theta: FloatArray) -> FloatArray:
        """Return (n,) torque or current at the points."""
        return np.asarray(self.predict_and_slope(space.numbers(theta, self.name))[0]).ravel()

    def residuals(self, space: ParameterSpace, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (n,) errors over their standard error and (n, parameters) their derivative."""
        numbers, slope = space.numbers_and_slope(theta, self.name)
        value, by_active = self.predict_and_slope(numbers)
        errors = (np.asarray(value).ravel() - self.measured) / self.std_error
        return errors, np.asarray(by_active) @ slope / self.std_error[:, None]

    def cost(self, space: ParameterSpace, theta: FloatArray) -> float:
        """Return half the sum of squared residuals."""
        errors = (self.predict(space, theta) - self.measured) / self.std_error
        return 0.5 * float(errors @ errors)


@dataclass(frozen=True)
class StaticFit:
    """Static points beside what the drive with the answer needs."""

    name: str
    split: Literal["train", "validation"]
    effort: Effort
    unit: str
    speed: FloatArray
    measured: FloatArray
    std_error: FloatArray
    noise_source: str
    predicted: FloatArray

    @property
    def rms(self) -> float:
        """Root mean square of the error."""
        return float(np.sqrt(np.mean((self.predicted - self.measured) ** 2)))

    @property
    def noise_ratio(self) -> float:
        """Root mean square of the errors over their standard errors."""
        return float(np.sqrt(np.mean(((self.predicted - self.measured) / self.std_error) ** 2)))


MISFIT = 5.0
"""Standard deviations beyond what scatter explains from which static points show that the model misses something."""


def misses_points(fit: StaticFit) -> bool:
    """Return whether the errors of static points are larger than their standard errors explain."""
    count = fit.speed.size
    return fit.noise_ratio**2 > 1.0 + MISFIT * float(np.sqrt(2.0 / count))


def static_fit(
    term: StaticTerm, space: ParameterSpace, theta: FloatArray, split: Literal["train", "validation"]
) -> StaticFit:
    """Return the points beside the prediction at the parameters `theta`."""
    own = (term.speed, term.measured, term.std_error, term.noise_source, term.predict(space, theta))
    return StaticFit(term.name, split, term.effort, term.unit, *own)


def static_term(use: StaticUse, drive: Drive, space: ParameterSpace) -> StaticTerm:
    """Return the residuals of static points; raises FrictionOcpError where their scatter is not known."""
    points = use.points
    effort, speed, measured = _signed(points)
    std_error, source = scatter_of(points, drive)
    return StaticTerm(
        name=use.name,
        effort=effort,
        speed=speed,
        measured=measured,
        std_error=std_error,
        noise_source=source,
        unit=points.units[effort],
        predict_and_slope=_function(drive, effort, space, _moving(points, speed), points.position),
    )


def _signed(points: StaticPoints) -> tuple[Effort, FloatArray, FloatArray]:
    """Return what was measured, and (n,) signed speeds and values of it."""
    sign = _signs(points)
    if points.torque is not None:
        return "torque", sign * points.speed, sign * points.torque
    assert points.current is not None
    return "current", sign * points.speed, sign * points.current


def _signs(points: StaticPoints) -> FloatArray:
    """Return the direction of points that state sizes with a direction, else 1: speeds are signed then."""
    if points.direction is None or np.any(points.speed < 0):
        return np.ones(points.speed.size)
    return np.where(points.direction < 0, -1.0, 1.0)


def _moving(points: StaticPoints, speed: FloatArray) -> FloatArray:
    """Return the speeds; at standstill, that of the least motion in the direction of the point."""
    direction = np.ones(speed.size) if points.direction is None else np.where(points.direction < 0, -1.0, 1.0)
    least = STANDSTILL * max(float(np.max(np.abs(speed), initial=0.0)), 1e-6)
    return np.where(speed == 0, direction * least, speed)


def _function(
    drive: Drive, effort: Effort, space: ParameterSpace, speed: FloatArray, position: FloatArray | None
) -> ca.Function:
    steady = steady_drive(drive, effort, position is not None)
    numbers = ca.SX.sym("numbers", len(space.leaf_names))
    place = {name: k for k, name in enumerate(space.leaf_names)}
    own = ca.vertcat(*[numbers[place[name]] for name in steady.parameter_names])
    omega, theta = ca.SX.sym("omega"), ca.SX.sym("theta")
    value = steady.effort(omega, theta, own)
    active = ca.vertcat(*[numbers[k] for k in space.active])
    point = ca.Function("point", [omega, theta, numbers], [value, ca.densify(ca.jacobian(value, active))])
    p = ca.MX.sym("p", numbers.numel())
    angles = np.zeros(speed.size) if position is None else position
    values, slopes = point.map(speed.size)(speed[None, :], angles[None, :], p)
    by_point = ca.reshape(slopes, active.numel(), speed.size).T
    return ca.Function("points", [p], [values.T, by_point])


def scatter_of(points: StaticPoints, drive: Drive) -> tuple[FloatArray, str]:
    """Return (n,) standard errors and where they come from: the file, the channel's noise, or neighbouring points.

    Raises FrictionOcpError where none of them tells it.
    """
    effort, speed, measured = _signed(points)
    count = np.ones(speed.size) if points.runs is None else np.maximum(points.runs, 1.0)
    if points.std_error is not None:
        return points.std_error, "std_error"
    signals = {f"{motor.name}.{effort}" for motor in drive.motors}
    stated = [channel.noise_std for channel in drive.channels if channel.measures in signals and channel.noise_std]
    if stated:
        return stated[0] / np.sqrt(count), "noise_std"
    scatter = _neighbour_scatter(speed, measured, count)
    if not scatter > 0:
        what = "the scatter of the points is not known"
        raise FrictionOcpError(Finding(points.name, what, f"/std_error, or {FEWEST} points and more a direction"))
    return scatter / np.sqrt(count), "estimate"


def _neighbour_scatter(speed: FloatArray, values: FloatArray, count: FloatArray) -> float:
    """Return the deviation of a single run from the lines between neighbouring points, each direction for itself.

    `count` (n,) runs are averaged in a point. Source: Gasser, Sroka & Jennen-Steinmetz 1986.
    """
    squares: list[FloatArray] = []
    for side in (speed > 0, speed < 0):
        order = np.argsort(speed[side], kind="stable")
        x, y, n = speed[side][order], values[side][order], count[side][order]
        if x.size < FEWEST:
            continue
        a = np.divide(x[2:] - x[1:-1], x[2:] - x[:-2], out=np.full(x.size - 2, 0.5), where=x[2:] > x[:-2])
        error = a * y[:-2] + (1.0 - a) * y[2:] - y[1:-1]
        squares.append(error**2 / (a**2 / n[:-2] + (1.0 - a) ** 2 / n[2:] + 1.0 / n[1:-1]))
    return float(np.sqrt(np.median(np.concatenate(squares)) / CHI_SQUARE_MEDIAN)) if squares else 0.0

"""Friction torque over speed and load with its confidence band."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from friction_ocp.drive.kick import transmitted_torque
from friction_ocp.drive.mechanism import Mechanism, Motion
from friction_ocp.drive.parts import Shaft, Transmission
from friction_ocp.drive.torques import elastic_torque
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.score import FreeRun
from friction_ocp.friction.smoothing import smooth_abs
from friction_ocp.friction.static import NoFriction
from friction_ocp.simulation.grid import FloatArray

POINTS = 201


@dataclass(frozen=True)
class FrictionCurve:
    """Steady-state friction torque of a shaft under one load."""

    shaft: str
    law: str
    load: float
    """Transmitted torque, N m (N)."""
    speed: FloatArray
    torque: FloatArray
    lower: FloatArray
    upper: FloatArray


def friction_curves(
    model: Model, theta: FloatArray, covariance: FloatArray, reach: float, runs: tuple[FreeRun, ...]
) -> tuple[FrictionCurve, ...]:
    """Return the friction of every shaft over the speeds that the recordings reach, with 95 % bands.

    `covariance` is (parameters, parameters), `reach` half an interval of 95 % over its standard error.
    Parameters at a bound count as known there; where nothing is known of any, bands are NaN.
    """
    mech = model.drive.mechanism
    curves: list[FrictionCurve] = []
    for shaft in mech.drive.shafts:
        if isinstance(shaft.friction.law, NoFriction):
            continue
        reached = [
            _fastest(mech, shaft.name, runs),
            *(item.top for name, item in model.speeds.items() if name == shaft.name),
        ]
        fastest = max(reached) or 1.0
        for load in _loads(model, shaft, theta, runs):
            curves.append(_curve(model, shaft, theta, reach**2 * covariance, fastest, load))
    return tuple(curves)


def _fastest(mech: Mechanism, name: str, runs: tuple[FreeRun, ...]) -> float:
    group = mech.topology.group_of[name]
    if group not in mech.free_groups or not runs:
        return 0.0
    column = len(mech.angle_groups) + mech.free_groups.index(group)
    speed = max(float(np.max(np.abs(run.states[:, column]))) for run in runs)
    ratio = mech.topology.speed_ratio[name]
    return speed * (1.0 if isinstance(ratio, ca.SX) else abs(float(ratio)))


def _loads(model: Model, shaft: Shaft, theta: FloatArray, runs: tuple[FreeRun, ...]) -> list[float]:
    """Return loads at which to show load-dependent friction: none, half and all of what gravity or springs give."""
    if shaft.friction.load is None or not runs:
        return [0.0]
    mech = model.drive.mechanism
    q = ca.SX.sym("q", len(mech.topology.roots))
    at = Motion(q, ca.SX.zeros(q.numel()), ca.SX.zeros(8), ca.SX.zeros(16))
    held = {joint.name: _held(mech, joint, at) for joint in mech.load_joints(shaft)}
    held |= {motor.name: motor.share * _gravity(mech, shaft.name, at) for motor in mech.loading_motors()}
    size = transmitted_torque(mech, shaft, held)
    inputs = ca.vertcat(*mech.inputs.values())
    function = ca.Function("load", [q, inputs, ca.vertcat(*mech.parameters.values())], [size])
    largest = 0.0
    for run, item in zip(runs, model.train, strict=False):
        if len(mech.angle_groups) == q.numel():
            numbers = model.space.numbers(theta, run.name)
            sizes = function.map(run.time.size)(run.states[:, : q.numel()].T, item.grid.at_node.T, numbers)
            largest = max(largest, float(np.quantile(np.asarray(sizes), 0.95)))
    if largest <= 0:
        return [0.0]
    shown = float(f"{largest:.2g}")
    return [0.0, 0.5 * shown, shown]


def _held(mech: Mechanism, joint: Transmission, at: Motion) -> ca.SX:
    """Return the torque through a joint that its spring, or gravity beyond it, holds at rest."""
    if not joint.rigid:
        return ca.SX(elastic_torque(mech, joint, at, 0.0))
    ratio = mech.topology.speed_ratio
    torque = sum(_gravity(mech, name, at) * ratio[name] for name in mech.topology.beyond(joint))
    return ca.SX(torque / ratio[joint.to_shaft])


def _gravity(mech: Mechanism, name: str, at: Motion) -> ca.SX:
    gravity = mech.drive.shaft(name).gravity
    if gravity is None:
        return ca.SX(0.0)
    angle: ca.SX = mech.shaft_angle(name, at) + gravity.phase
    return gravity.torque * ca.sin(angle)


def _curve(
    model: Model, shaft: Shaft, theta: FloatArray, band: FloatArray, fastest: float, load: float
) -> FrictionCurve:
    """Return one curve; `band` (parameters, parameters) is the covariance times the square of the reach."""
    omega = ca.SX.sym("omega")
    parameters = ca.vertcat(*model.drive.mechanism.parameters.values())
    element = shaft.friction
    positive, negative = (element.magnitude(side, smooth_abs(omega), load) for side in ("positive", "negative"))
    torque = ca.if_else(omega >= 0, positive, -negative)
    active = ca.vertcat(*[parameters[k] for k in model.space.active])
    function = ca.Function("curve", [omega, parameters], [torque, ca.densify(ca.jacobian(torque, active))])
    grid = np.linspace(-fastest, fastest, POINTS + 1)
    numbers, slope = model.space.numbers_and_slope(theta, model.problem.fitted[0].name)
    values, by_active = function.map(grid.size)(grid[None, :], numbers)
    by_theta = np.asarray(by_active).reshape(grid.size, -1) @ slope
    known = np.nan_to_num(band) if np.isfinite(band).any() else band
    half = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", by_theta, known, by_theta), 0.0))
    values = np.asarray(values).ravel()
    return FrictionCurve(shaft.name, element.law.name, load, grid, values, values - half, values + half)

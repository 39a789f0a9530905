"""Torque noise that the noise of measured inputs makes, and what channels see of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import casadi as ca
import numpy as np

from friction_ocp.drive.mechanism import Mechanism
from friction_ocp.drive.parts import Channel, Drive
from friction_ocp.simulation.grid import FloatArray

SHORTEST, MOST_SEGMENTS = 2, 3000
"""Samples in a segment, and segments in one recording: more cost time, fewer blur what torque noise gathers within."""
QUARTERS = np.array([0.25, 0.5, 0.75, 1.0])
"""Shares of a segment at which what gathers within it is looked at."""


def driving(drive: Drive, numbers: Mapping[str, float]) -> Iterator[tuple[str, Channel, float]]:
    """Yield the shaft that a motor turns, an input channel that drives this motor, and the torque per unit shown."""
    for motor in drive.motors:
        constant = numbers.get(f"{motor.name}.torque_constant", 1.0)
        factors = {"torque": 1.0, "current": constant, "current_command": constant}
        factors["voltage"] = constant / max(numbers.get(f"{motor.name}.resistance", 1.0), 1e-300)
        for channel in drive.inputs:
            if channel.part == motor.name and channel.signal in factors:
                gain = numbers.get(f"{channel.name}.gain", 1.0) or 1.0
                yield motor.shaft, channel, factors[channel.signal] / gain


def speed_ratio(mech: Mechanism, numbers: Mapping[str, float], shaft: str) -> float:
    """Return the speed of a shaft over that of its group's first shaft."""
    ratio = mech.topology.speed_ratio[shaft]
    if not isinstance(ratio, ca.SX):
        return float(ratio)
    function = ca.Function("ratio", list(mech.parameters.values()), [ratio])
    return float(function(*(numbers.get(name, 1.0) for name in mech.parameters)))


def shown_speed(mech: Mechanism, numbers: Mapping[str, float], channel: Channel) -> float:
    """Return what a channel of an angle or a speed shows of the speed, over that of its group's first shaft."""
    return speed_ratio(mech, numbers, channel.part) * numbers.get(f"{channel.name}.gain", 1.0)


def input_power(
    drive: Drive, numbers: Mapping[str, float], noise: Callable[[Channel], tuple[float, float]]
) -> dict[str, float]:
    """Return by shaft the power density, (N m)^2/Hz, of the torque that noise of inputs makes.

    `noise` gives the deviation of an input and its sampling interval, s.
    """
    power: dict[str, float] = {}
    for shaft, channel, factor in driving(drive, numbers):
        std, step = noise(channel)
        power[shaft] = power.get(shaft, 0.0) + (factor * std) ** 2 * step
    return power


def seen_variance(mech: Mechanism, numbers: Mapping[str, float], covariances: FloatArray) -> FloatArray:
    """Return (outputs,) the mean variance that covariances (k, states, states) make of recorded angles and speeds."""
    mean = dict(zip(mech.state_names, np.mean(np.einsum("sii->si", covariances), axis=0), strict=True))
    added = np.zeros(len(mech.drive.outputs))
    for k, channel in enumerate(mech.drive.outputs):
        group = mech.topology.group_of.get(channel.part)
        name = "" if group is None else f"{mech.topology.roots[group]}.{channel.signal}"
        if name in mean:
            added[k] = shown_speed(mech, numbers, channel) ** 2 * float(mean[name])
    return added


def acceleration_noise(mech: Mechanism, densities: Mapping[str, float], numbers: FloatArray) -> FloatArray:
    """Return the density of the acceleration noise of each group, referred to its first shaft, rad/s^2/sqrt(Hz).

    `densities` of torque by shaft, N m/sqrt(Hz); `numbers` (parameters,) of the drive.
    """
    power = [ca.SX(0.0) for _ in mech.topology.roots]
    for shaft, density in densities.items():
        power[mech.topology.group_of[shaft]] += (density * mech.topology.speed_ratio[shaft]) ** 2
    spread: list[ca.SX] = [ca.sqrt(power[k]) / ca.fmax(mech.inertia(k), 1e-300) for k in range(len(power))]
    function = ca.Function("noise", [ca.vertcat(*mech.parameters.values())], [ca.vertcat(*spread)])
    return np.asarray(function(numbers)).ravel()


def torque_covariance(mech: Mechanism, still: FloatArray, noise: FloatArray, spans: FloatArray) -> FloatArray:
    """Return (spans, states, states): `still` (states, states), and what accelerations of density `noise` add to it.

    Torque noise of density q N m/sqrt(Hz) on an inertia J makes the speed a random walk: var(v) = q^2 T / J^2,
    cov(q, v) = q^2 T^2 / (2 J^2), var(q) = q^2 T^3 / (3 J^2). `still` may differ by span: (spans, states, states).
    """
    covariance = np.broadcast_to(still, (spans.size, *still.shape[-2:])).copy()
    position = {group: k for k, group in enumerate(mech.angle_groups)}
    for k, group in enumerate(mech.free_groups):
        v, q = len(mech.angle_groups) + k, position[group]
        power = noise[group] ** 2 * spans
        covariance[:, v, v] += power
        covariance[:, q, q] += power * spans**2 / 3.0
        covariance[:, q, v] += power * spans / 2.0
        covariance[:, v, q] += power * spans / 2.0
    return covariance

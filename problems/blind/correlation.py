"""The first baseline: what the base model's errors correlate with most.

The torque that the first shaft seems to lack is the inertia times the second derivative of the error of its angle in
the free run, less the torque of the current's error. Its correlation with one feature for every effect and place,
beyond what the features of the base model take, picks the answer, in competition with features of the errors of the
channels; shuffled signs say when the best of all is no better than chance. Features are made from the simulated motion,
which shares no noise with the errors.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

import friction_ocp as fo
from friction_ocp import Problem, Simulation

WINDOW = 61
"""Samples of the filter that differentiates."""
BLOCK = 200
"""Samples that change sign together when chance is measured."""
SHUFFLES, CHANCE = 19, 0.95
SHARES = (3, 4, 5, 6, 8, 10, 13, 16, 20)
"""Periods that are tried, as parts of the travel or the duration."""
TURNS = (1, 2, 4, 6, 7, 11, 12, 14, 21, 24)
"""Periods that are tried, as parts of a turn."""
Pair = tuple[str, str]
Features = Iterator[tuple[str, np.ndarray]]


@dataclass(frozen=True)
class Motion:
    """One recording of one shaft."""

    time: np.ndarray
    theta: np.ndarray
    omega: np.ndarray
    alpha: np.ndarray
    torque: np.ndarray
    """Of the motor, as the shaft feels it."""


def _derivative(values: np.ndarray, step: float, order: int) -> np.ndarray:
    return savgol_filter(values, WINDOW, 3, deriv=order, delta=step)


def _ratios(problem: Problem) -> dict[str, float]:
    """Return the speed of the first shaft over that of each shaft."""
    first = problem.drive.shafts[0].name
    ratios = {first: 1.0}
    for part in problem.drive.transmissions:
        ratios[part.to_shaft] = ratios[part.from_shaft] * _number(part.ratio)
    return ratios


def _number(value: object) -> float:
    return float(getattr(value, "guess", value))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Lack:
    """What one recording says: motions by shaft, the torque that the first shaft seems to lack, errors by channel."""

    motions: Mapping[str, Motion]
    missing: np.ndarray
    errors: Mapping[str, np.ndarray]
    values: Mapping[str, np.ndarray]


def lacks(simulation: Simulation) -> list[Lack]:
    """Return what the training recordings of a simulated base model say."""
    problem = simulation.problem
    return [_lack(problem, simulation, k) for k in range(len(simulation.train))]


def _lack(problem: Problem, simulation: Simulation, index: int) -> Lack:
    run, recording = simulation.train[index], problem.train[index].recording
    ratios, motor = _ratios(problem), problem.drive.motors[0]
    outputs = [channel.name for channel in problem.drive.outputs]
    seen = np.isfinite(run.measured).all(axis=1)
    time, step = run.time[seen], float(np.median(np.diff(run.time[seen])))
    errors = {name: (run.measured - run.simulated)[seen, k] for k, name in enumerate(outputs)}
    signals = {channel.measures: recording.channels[channel.name].values for channel in problem.drive.inputs}
    signals |= {channel.measures: run.simulated[seen, k] for k, channel in enumerate(problem.drive.outputs)}
    first = problem.drive.shafts[0].name
    angle, constant = signals[f"{first}.theta"], _number(motor.torque_constant)
    if motor.resistance is None:
        torque = constant * signals[f"{motor.name}.current"]
    else:
        torque = _derivative(angle, step, 2) * _inertia(problem, ratios)
    motions = {
        name: Motion(time, angle / ratio, _derivative(angle, step, 1) / ratio, _derivative(angle, step, 2) / ratio,
                     torque * ratio)
        for name, ratio in ratios.items()
    }  # fmt: skip
    missing = _inertia(problem, ratios) * _derivative(errors[_encoder(problem, first)], step, 2)
    for channel in problem.drive.outputs:
        if channel.signal == "current":
            missing = missing - constant * savgol_filter(errors[channel.name], WINDOW, 3)
    missing[_seams(time, simulation.horizon_s)] = 0.0
    values = {name: run.simulated[seen, k] for k, name in enumerate(outputs)}
    return Lack(motions, missing, errors, values)


def _seams(time: np.ndarray, horizon: float | None) -> np.ndarray:
    """Return the samples whose derivative would reach over the end of a window of the free run."""
    if horizon is None:
        return np.zeros(time.size, dtype=bool)
    edges = np.linspace(time[0], time[-1], max(1, round((time[-1] - time[0]) / horizon)) + 1)
    near = np.abs(time[:, None] - edges).min(axis=1)
    return near < 0.5 * WINDOW * np.median(np.diff(time))


def _encoder(problem: Problem, shaft: str) -> str:
    return next(channel.name for channel in problem.drive.outputs if channel.measures == f"{shaft}.theta")


def _inertia(problem: Problem, ratios: Mapping[str, float]) -> float:
    """Return the inertia of the drive at its first shaft."""
    return sum(_number(shaft.inertia) / ratios[shaft.name] ** 2 for shaft in problem.drive.shafts)


def _waves(place: np.ndarray, periods: Iterator[float] | list[float], factor: np.ndarray) -> Iterator[np.ndarray]:
    for period in periods:
        phase = 2 * np.pi * place / period
        yield np.column_stack([factor * np.cos(phase), factor * np.sin(phase)])


def shaft_features(motion: Motion, first: bool) -> Features:
    """Yield an effect and its feature (n, k) on a shaft; an effect may have several to choose from."""
    w, side = motion.omega, np.sign(motion.omega)
    typical, travel = float(np.sqrt(np.mean(w**2))), float(np.ptp(motion.theta))
    one = np.ones_like(w)
    for share in (0.05, 0.15, 0.4):
        yield "stribeck", (side * np.exp(-((w / (share * typical)) ** 2)))[:, None]
    for share in (0.3, 0.6, 1.0):
        yield "polyline_break", (side * np.maximum(np.abs(w) - share * typical, 0.0))[:, None]
    yield "quadratic_drag", (w * np.abs(w))[:, None]
    yield "asymmetry", np.abs(side)[:, None]
    yield "asymmetry", np.abs(w)[:, None]
    for wave in _waves(motion.theta, [travel / share for share in SHARES], side):
        yield "position_ripple", wave
    since = np.abs(motion.theta - _last_reversal(motion.theta, side))
    for share in (0.003, 0.02):
        yield "presliding", (side * np.exp(-since / (share * travel)))[:, None]
    yield "load_dependence", (side * np.abs(motion.torque))[:, None]
    yield "warm_up", np.column_stack([side * motion.time, w * motion.time])
    for wave in _waves(motion.theta, [2 * np.pi], one):
        yield "unbalance", wave
    yield "constant_torque", one[:, None]
    for wave in _waves(motion.time, [float(np.ptp(motion.time)) / share for share in (*SHARES, 26, 34, 45)], one):
        yield "periodic_disturbance", wave
    yield "structural_mode", np.gradient(np.gradient(motion.alpha, motion.time), motion.time)[:, None]
    yield "inertia_error", motion.alpha[:, None]
    if first:
        yield from _motor_features(motion)


def _motor_features(motion: Motion) -> Features:
    one = np.ones_like(motion.omega)
    for wave in _waves(motion.theta, [2 * np.pi / n for n in TURNS], one):
        yield "cogging", wave
    for wave in _waves(motion.theta, [2 * np.pi / n for n in TURNS], motion.torque):
        yield "torque_ripple", wave
    yield "drive_lag", np.gradient(motion.torque, motion.time)[:, None]
    yield "torque_saturation", (motion.torque**3)[:, None]
    yield "parameter_error", motion.torque[:, None]


def _last_reversal(theta: np.ndarray, side: np.ndarray) -> np.ndarray:
    turned = np.concatenate([[True], side[1:] != side[:-1]])
    return theta[np.maximum.accumulate(np.where(turned, np.arange(theta.size), 0))]


def joint_features(output: Motion, rigid: bool) -> Features:
    """Yield an effect and its feature on a transmission, from the motion of its output."""
    load = output.alpha
    rate = np.gradient(load, output.time)
    if rigid:
        yield "compliance", np.gradient(rate, output.time)[:, None]
        return
    yield "backlash", np.gradient(np.tanh(load / np.std(load)), output.time)[:, None]
    yield "stiffening", np.gradient(np.gradient(load**3, output.time), output.time)[:, None]
    yield "transmission_hysteresis", np.sign(rate)[:, None]
    for wave in _waves(output.theta, [float(np.ptp(output.theta)) / share for share in SHARES], np.ones_like(load)):
        yield "kinematic_error", wave


def channel_features(values: np.ndarray, time: np.ndarray) -> Features:
    """Yield an effect and its feature in the error of a channel."""
    yield "sensor_offset", np.ones_like(values)[:, None]
    yield "sensor_gain", values[:, None]
    yield "sensor_delay", np.gradient(savgol_filter(values, WINDOW, 3), time)[:, None]
    for wave in _waves(values, [2 * np.pi], np.ones_like(values)):
        yield "sensor_eccentricity", wave


@dataclass(frozen=True)
class Tried:
    """A feature as the directions that it adds to what the base model takes, and the target that it is held against."""

    pair: Pair
    target: np.ndarray
    """Without what the base model takes."""
    directions: np.ndarray
    """(n, k) orthonormal."""

    def explained(self, target: np.ndarray) -> float:
        """Return the share of squares of a target in these directions."""
        return float(np.sum((self.directions.T @ target) ** 2) / max(float(np.sum(target**2)), 1e-300))


def tried(pair: Pair, target: np.ndarray, feature: np.ndarray, known: np.ndarray) -> Tried:
    """Take the known features out of a target and a feature."""
    basis, _ = np.linalg.qr(known)
    own = feature - basis @ (basis.T @ feature)
    keep = np.linalg.norm(own, axis=0) > 1e-6 * np.linalg.norm(feature, axis=0).max(initial=1e-300)
    directions, _ = np.linalg.qr(own[:, keep])
    return Tried(pair, target - basis @ (basis.T @ target), directions)


def _candidates(found: list[Lack], problem: Problem) -> Iterator[Tried]:
    """Yield every feature over all recordings."""
    first = problem.drive.shafts[0].name
    missing = np.concatenate([item.missing for item in found])
    known = np.concatenate([_base_features(item.motions[first]) for item in found])
    for shaft in problem.drive.shafts:
        features = [shaft_features(item.motions[shaft.name], shaft.name == first) for item in found]
        yield from _held(features, shaft.name, missing, known)
    for part in problem.drive.transmissions:
        features = [joint_features(item.motions[part.to_shaft], part.stiffness is None) for item in found]
        yield from _held(features, part.name, missing, known)
    for channel in [item for item in problem.drive.outputs if item.signal != "current"]:
        target = np.concatenate([item.errors[channel.name] for item in found])
        features = [channel_features(item.values[channel.name], item.motions[first].time) for item in found]
        yield from _held(features, channel.name, target, np.zeros((target.size, 0)))


def _held(features: list[Features], place: str, target: np.ndarray, known: np.ndarray) -> Iterator[Tried]:
    for group in zip(*features, strict=True):
        yield tried((group[0][0], place), target, np.concatenate([item for _, item in group]), known)


def _base_features(motion: Motion) -> np.ndarray:
    """Return what the base model explains itself: dry and viscous friction, inertia, a weight that it knows."""
    return np.column_stack([np.sign(motion.omega), motion.omega, motion.alpha])


def _flips(size: int, rng: np.random.Generator) -> np.ndarray:
    """Return signs drawn at random for blocks of samples."""
    return np.repeat(rng.choice((-1.0, 1.0), -(-size // BLOCK)), BLOCK)[:size]


def answer(problem: Problem, rng: np.random.Generator) -> Pair | None:
    """Return the effect and place that the errors of a fitted base model correlate with most; None: with none."""
    candidates = list(_candidates(lacks(fo.simulate(problem)), problem))
    scores = [item.explained(item.target) for item in candidates]
    best = int(np.argmax(scores))
    chance: list[float] = []
    for _ in range(SHUFFLES):
        flips = _flips(candidates[0].target.size, rng)
        chance.append(max(item.explained(item.target * flips) for item in candidates))
    return candidates[best].pair if scores[best] > np.quantile(chance, CHANCE) else None

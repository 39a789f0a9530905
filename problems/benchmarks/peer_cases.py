"""The estimation problems that peers are given: the equations in plain arithmetic, and the data as arrays.

Equations are written once for every tool: `m` is where tanh, exp and the like come from. The sign of a speed is
smoothed over a width, as no peer has set-valued friction; inputs, starts, bounds and noise are those that this package
gets.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import emps
import numpy as np
import numpy.typing as npt
from telescope_axis import (
    DAMPING,
    LOAD_FRICTION,
    MOTOR_INERTIA,
    RATE,
    RATIO,
    TORQUE_NOISE,
    make_problem,
    make_run,
    truth,
)

from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.problem import Problem
from friction_ocp.problem_file.load import load_problem

sys.path.insert(0, str(emps.PROBLEMS))
from convert import convert_folder

FloatArray = npt.NDArray[np.float64]
Equations = Callable[[Sequence[Any], Sequence[Any], Sequence[Any], Any], list[Any]]

SEED = 5
SERVO = Path(__file__).parents[1] / "xl330" / "coulomb_viscous.yaml"
WIDTH = 0.05
"""Of the smoothed sign of the motor's speed, rad/s; the motor turns at up to 200 rad/s."""


@dataclass(frozen=True)
class Run:
    """One recording as arrays."""

    time: FloatArray
    """(n,) s."""
    inputs: FloatArray
    """(n - 1, inputs) means over each interval."""
    measured: FloatArray
    """(n, outputs)."""
    states: FloatArray
    """(n, states) from the smoothed measurement, to start from."""

    def thinned(self, every: int) -> Run:
        """Keep every n-th sample; inputs are means over what was left out."""
        last = (self.time.size - 1) // every * every
        kept = slice(0, last + 1, every)
        inputs = self.inputs[:last].reshape(last // every, every, -1).mean(axis=1)
        return Run(self.time[kept], inputs, self.measured[kept], self.states[kept])


@dataclass(frozen=True)
class Case:
    """One problem."""

    name: str
    problem: Problem
    """As this package gets it."""
    names: tuple[str, ...]
    """Fitted parameters."""
    guess: FloatArray
    lower: FloatArray
    upper: FloatArray
    reference: FloatArray | None
    """True or published values."""
    equations: Equations
    """Derivatives of the states from (states, inputs, parameters, arithmetic)."""
    outputs: Equations
    noise: FloatArray
    """(outputs,) noise floors."""
    state_scale: FloatArray
    input_noise: float
    """Standard deviation of the noise of the first input, per sample; 0 where the fit is a free run."""
    inertia: float
    """Behind the first input: its noise gathers in the speed behind it."""
    runs: tuple[Run, ...]
    substeps: int = 1
    """Runge-Kutta steps a sample."""
    stiff: bool = False
    """Whether a bristle makes explicit steps fail."""

    @property
    def scale(self) -> FloatArray:
        """(parameters,) to bring them to order one."""
        return np.where(self.guess != 0, np.abs(self.guess), 0.1 * (self.upper - self.lower))

    @property
    def period(self) -> float:
        """Mean time between samples, s."""
        return float(np.mean(np.diff(self.runs[0].time)))

    def thinned(self, every: int) -> Case:
        """Return the case with every n-th sample."""
        runs = tuple(run.thinned(every) for run in self.runs)
        noise = self.input_noise / np.sqrt(every)
        return replace(self, runs=runs, input_noise=noise, substeps=self.substeps * every)

    def evenly_weighted(self) -> Case:
        """Return the case with outputs weighted by their spread: noise floors mean little to a free run that drifts."""
        return replace(self, noise=np.std(np.concatenate([run.measured for run in self.runs]), axis=0))

    def gap_root(self, span: float) -> FloatArray:
        """Return (states, states) W with W'W the inverse covariance of what noise gathers over `span` s."""
        states = self.state_scale.size
        covariance = np.diag((1e-4 * self.state_scale) ** 2)
        density = self.input_noise * np.sqrt(self.period) / self.inertia
        angle, speed = 0, states // 2 if not self.stiff else 1
        covariance[angle, angle] += density**2 * span**3 / 3.0
        covariance[speed, speed] += density**2 * span
        covariance[angle, speed] = covariance[speed, angle] = density**2 * span**2 / 2.0
        if self.stiff:
            covariance[2, 2] = (1e-2 * self.state_scale[2]) ** 2
        return np.linalg.inv(np.linalg.cholesky(covariance))


def soft_sign(speed: Any, width: float, m: Any) -> Any:
    """Return the sign, smoothed."""
    return m.tanh(speed / width)


def soft_abs(value: Any, width: float, m: Any) -> Any:
    """Return the magnitude, rounded."""
    return m.sqrt(value * value + width * width)


def polyline_equations(x: Sequence[Any], u: Sequence[Any], p: Sequence[Any], m: Any) -> list[Any]:
    """Two masses on a spring, polyline friction on the motor, Coulomb and viscous on the load; angles before speeds."""
    angle, load_angle, speed, load_speed = x
    tau_c, slope, slope_after, knee, load_tau_c, load_viscous, stiffness, load_inertia = p
    magnitude = soft_abs(speed, WIDTH, m)
    beyond = 0.5 * (magnitude - knee + soft_abs(magnitude - knee, 4.0 * WIDTH, m))
    line = tau_c + slope * magnitude + (slope_after - slope) * beyond
    spring = stiffness * (angle / RATIO - load_angle) + DAMPING * (speed / RATIO - load_speed)
    friction = soft_sign(speed, WIDTH, m) * line
    on_load = load_tau_c * soft_sign(load_speed, WIDTH / RATIO, m) + load_viscous * load_speed
    return [speed, load_speed, (u[0] - friction - spring / RATIO) / MOTOR_INERTIA, (spring - on_load) / load_inertia]


def lugre_equations(x: Sequence[Any], u: Sequence[Any], p: Sequence[Any], m: Any) -> list[Any]:
    """The same with LuGre friction on the motor; states angle, speed, bristle, angle and speed of the load."""
    angle, speed, bristle, load_angle, load_speed = x
    _, _, _, sigma0, sigma1, sigma2, stiffness, load_inertia = p
    rate = speed - bristle_rate(speed, p, m) * bristle
    spring = stiffness * (angle / RATIO - load_angle) + DAMPING * (speed / RATIO - load_speed)
    friction = sigma0 * bristle + sigma1 * rate + sigma2 * speed
    on_load = LOAD_FRICTION["tau_c"] * soft_sign(load_speed, WIDTH / RATIO, m) + LOAD_FRICTION["viscous"] * load_speed
    return [
        speed,
        (u[0] - friction - spring / RATIO) / MOTOR_INERTIA,
        rate,
        load_speed,
        (spring - on_load) / load_inertia,
    ]


def bristle_rate(speed: Any, p: Sequence[Any], m: Any) -> Any:
    """Return how fast the bristle forgets, 1/s."""
    tau_c, tau_s, omega_s, sigma0 = p[:4]
    level = tau_c + (tau_s - tau_c) * m.exp(-((speed / omega_s) ** 2))
    return sigma0 * soft_abs(speed, 1e-3, m) / level


def carriage_equations(x: Sequence[Any], u: Sequence[Any], p: Sequence[Any], m: Any) -> list[Any]:
    """One mass with Coulomb and viscous friction and a constant force."""
    mass, tau_c, viscous, constant = p
    return [x[1], (u[0] + constant - tau_c * soft_sign(x[1], 1e-3, m) - viscous * x[1]) / mass]


def servo_equations(x: Sequence[Any], u: Sequence[Any], p: Sequence[Any], m: Any) -> list[Any]:
    """A servo with a pendulum in the loop of its firmware; inputs goal, supply voltage, enable, gain."""
    inertia, tau_c, viscous, constant, resistance, offset = p
    goal, supply, enable, gain = u
    voltage = supply * m.fmax(-1.0, m.fmin(1.0, gain * (goal - x[0] - offset)))
    torque = enable * constant * (voltage - constant * x[1]) / resistance
    friction = tau_c * soft_sign(x[1], 0.05, m) + viscous * x[1]
    return [x[1], (torque - friction - 0.480690 * m.sin(x[0])) / (inertia + 0.0049)]


def axis(law: str, samples: int, name: str) -> Case:
    """Return the two-mass telescope axis, started as the first of the random starts of speed.py."""
    rng = np.random.default_rng(SEED)
    factors = {key: float(10.0 ** rng.uniform(-0.5, 0.5)) for key in truth(law)}
    problem = make_problem(law, make_run(law, samples, 1), factors)
    known, model = truth(law), prepare(problem)
    order = ("motor.theta", "load.theta", "motor.omega", "load.omega")
    if law == "lugre":
        order = ("motor.theta", "motor.omega", "motor.friction.z", "load.theta", "load.omega")
    reference = np.array(list(known.values()))
    start = np.array([factors[key] for key in known]) * reference
    outputs = (lambda x, u, p, m: [x[0], x[3]]) if law == "lugre" else (lambda x, u, p, m: [x[0], x[1]])
    return Case(
        name,
        problem,
        tuple(known),
        start,
        reference / 10.0,
        reference * 10.0,
        reference,
        lugre_equations if law == "lugre" else polyline_equations,
        outputs,
        model.noise,
        _ordered(model, order)[0],
        TORQUE_NOISE,
        MOTOR_INERTIA,
        tuple(_run(model, item, order) for item in model.train),
        substeps=5 if law == "lugre" else 1,
        stiff=law == "lugre",
    )


def carriage() -> Case | None:
    """Return EMPS, force-driven; None where the data are absent."""
    source = emps.source_folder()
    if source is None:
        return None
    with tempfile.TemporaryDirectory() as scratch:
        convert_folder(source, Path(scratch))
        text = (emps.PROBLEMS / "force_driven.yaml").read_text(encoding="utf-8")
        path = Path(scratch) / "force_driven.yaml"
        path.write_text(text, encoding="utf-8")
        problem = load_problem(path)
    model = prepare(problem)
    names = (
        "carriage.inertia",
        "carriage.friction.tau_c",
        "carriage.friction.viscous",
        "carriage.external_torque.constant",
    )
    order = ("carriage.theta", "carriage.omega")
    published = np.array([emps.SYMMETRIC[key] * (-1.0 if key.endswith("constant") else 1.0) for key in names])
    guess, lower, upper = _bounds(model, names)
    noise = problem.estimation.process_noise["carriage"] * np.sqrt(RATE)
    runs = tuple(_run(model, item, order) for item in model.train)
    scale, inertia = _ordered(model, order)[0], float(guess[0])
    outputs: Equations = lambda x, u, p, m: [x[0]]  # noqa: E731
    bounds = (guess, lower, upper, published)
    return Case("emps", problem, names, *bounds, carriage_equations, outputs, model.noise, scale, noise, inertia, runs)


def servo() -> Case:
    """Return the XL330 with Coulomb and viscous friction."""
    problem = load_problem(SERVO)
    model = prepare(problem)
    guess, lower, upper = _bounds(model, model.space.names)
    order = ("pendulum.theta", "pendulum.omega")
    runs: list[Run] = []
    for item, use in zip(model.train, problem.train, strict=True):
        run = _run(model, item, order, ("goal_position", "supply_voltage", "torque_enable"))
        gain = np.full((len(run.inputs), 1), use.set["controller.kp"])
        runs.append(replace(run, inputs=np.hstack([run.inputs, gain])))
    scale = np.std(np.concatenate([run.states for run in runs]), axis=0)
    outputs: Equations = lambda x, u, p, m: [x[0] + p[5]]  # noqa: E731
    bounds = (guess, lower, upper, None)
    names = model.space.names
    inertia = float(guess[0]) + 0.0049
    return Case(
        "xl330",
        problem,
        names,
        *bounds,
        servo_equations,
        outputs,
        model.noise,
        scale,
        0.0,
        inertia,
        tuple(runs),
        substeps=2,
    )


CASES: dict[str, Callable[[], Case | None]] = {
    "polyline": lambda: axis("polyline", 10_000, "polyline"),
    "telescope": lambda: axis("polyline", 24_000, "telescope"),
    "lugre": lambda: axis("lugre", 10_000, "lugre"),
    "emps": carriage,
    "xl330": servo,
}


def _bounds(model: Model, names: Sequence[str]) -> tuple[FloatArray, FloatArray, FloatArray]:
    at = [model.space.names.index(name) for name in names]
    return model.space.guess[at], model.space.lower[at], model.space.upper[at]


def _ordered(model: Model, order: Sequence[str]) -> tuple[FloatArray, list[int]]:
    at = [model.drive.state_names.index(name) for name in order]
    return model.state_scale[at], at


def _run(model: Model, item: Experiment, order: Sequence[str], inputs: Sequence[str] = ()) -> Run:
    """Read a recording off its grid: sampled nodes, inputs as the grid holds them, states that the start would take."""
    seen = np.flatnonzero(np.all(np.isfinite(item.measured), axis=1))
    columns = [model.drive.input_names.index(name) for name in inputs] if inputs else [0]
    mean = 0.5 * (item.grid.at_start + item.grid.at_end)[:, columns]
    counts = np.diff(seen)[:, None]
    summed = np.add.reduceat(mean[: seen[-1]], seen[:-1], axis=0)
    numbers = model.space.numbers(model.space.guess, item.name)
    signals = (item.smooth, item.rate, item.curvature, item.grid.at_node)
    states = np.asarray(model.sweep.start.map(item.grid.time.size)(*(part.T for part in signals), numbers)[0]).T
    if set(order) <= set(model.drive.state_names):
        chosen = states[:, _ordered(model, order)[1]]
    else:
        chosen = np.column_stack([item.smooth[:, 0], item.rate[:, 0]])
    return Run(item.grid.time[seen], summed / counts, item.measured[seen], chosen[seen])

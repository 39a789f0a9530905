"""One machine twice: the plant that simulates it independently, and the drive under test made from the same numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from plant import (
    Plant,
    PlantController,
    PlantFriction,
    PlantLoop,
    PlantMotor,
    PlantRipple,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    PlantWarmUp,
    Trajectory,
)

from friction_ocp.drive.following import DELAYED
from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.parts import (
    Channel,
    Cogging,
    Controller,
    Disturbance,
    Drive,
    Eccentricity,
    ExternalTorque,
    Gravity,
    Hysteresis,
    KinematicError,
    LoopSprings,
    Motor,
    SecondStage,
    Shaft,
    TorqueRipple,
    Transmission,
)
from friction_ocp.drive.stepping import SteppedDrive, stepped
from friction_ocp.drive.values import drive_leaves
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.gms import MaxwellElement
from friction_ocp.friction.maxwell import STIFFNESSES
from friction_ocp.friction.modifiers import Ripple, WarmUp
from friction_ocp.friction.registry import friction_laws
from friction_ocp.friction.static import Polyline
from friction_ocp.parameters import Directional
from friction_ocp.simulation.grid import APPLY, COMPUTE, Grid, InputSignal, build_grid

PLANT_STEP = 2e-5

FIELDS = {
    "none": (),
    "coulomb": ("tau_c",),
    "viscous": ("viscous",),
    "coulomb_viscous": ("tau_c", "viscous"),
    "stribeck": ("tau_c", "tau_s", "omega_s", "viscous", "delta"),
    "polyline": ("tau_c", "slopes", "breaks"),
    "quadratic": ("tau_c", "viscous", "quadratic"),
    "dahl": ("tau_c", "sigma0", "sigma2"),
    "lugre": ("tau_c", "tau_s", "omega_s", "sigma0", "sigma1", "sigma2", "delta"),
    "gms": ("tau_c", "tau_s", "omega_s", "viscous", "delta"),
    "polyline_hysteresis": ("tau_c", "slopes", "breaks"),
}


def _by_direction(value: object) -> object:
    return Directional(*value) if isinstance(value, tuple) else value


def friction_of(friction: PlantFriction) -> FrictionElement:
    """Return the friction under test with the plant's numbers."""
    numbers: dict[str, object] = {}
    for name in FIELDS[friction.law]:
        value = getattr(friction, "viscous" if name == "sigma2" else name)
        if name in ("slopes", "breaks"):
            numbers[name] = tuple(_by_direction(item) for item in value)
        elif name == "omega_s" and friction.omega_s == 0.0:
            numbers[name] = 1.0
        else:
            numbers[name] = _by_direction(friction.tau_c if value is None else value)
    if friction.law == "gms":
        numbers["elements"] = tuple(MaxwellElement(*element) for element in friction.elements)
    if friction.law == "polyline_hysteresis":
        numbers = {"polyline": Polyline(**numbers), "width": _by_direction(friction.width)}
    shares = (friction.load_coulomb, friction.load_stribeck, friction.load_viscous)
    load = LoadDependence(*(_by_direction(share) for share in shares)) if any(shares) else None
    return FrictionElement(friction_laws()[friction.law](**numbers), load)


def _wave(term: type[Any], ripple: PlantRipple | None) -> Any:
    return None if ripple is None else term(ripple.cosine, ripple.sine, ripple.period)


def _warm_up(warm_up: PlantWarmUp | None) -> WarmUp | None:
    if warm_up is None:
        return None
    warm = WarmUp(0.0, warm_up.dry, warm_up.time_constant, viscous_excess=warm_up.viscous - warm_up.dry)
    return replace(warm, loss_share=1.0, power=warm_up.power) if warm_up.power else warm


def _eccentric(sensor: PlantSensor) -> Channel:
    """Return the channel of a sensor; ours shows no error at the angle 0, the plant's one of mean zero."""
    wave, offset = sensor.eccentricity, sensor.offset
    if wave is not None and sensor.measures.endswith(".theta"):
        offset += sensor.gain * wave.cosine
    eccentricity = None if wave is None else Eccentricity(wave.cosine, wave.sine)
    measures = sensor.measures.replace(".command", ".current")
    known = (sensor.name, measures, "output", sensor.gain, offset, sensor.delay, sensor.resolution)
    return Channel(*known, eccentricity=eccentricity)


def _shaft(shaft: PlantShaft) -> Shaft:
    friction = friction_of(shaft.friction)
    return Shaft(
        shaft.name,
        shaft.inertia,
        replace(friction, ripple=_wave(Ripple, shaft.ripple), warm_up=_warm_up(shaft.warm_up)),
        Gravity(*shaft.gravity) if any(shaft.gravity) else None,
        ExternalTorque(shaft.external_torque) if shaft.external_torque else None,
        disturbance=_wave(Disturbance, shaft.disturbance),
    )


def _loop(loop: PlantLoop) -> Hysteresis:
    """Return the loop of a smooth element, or of three sharp ones half a decade apart, the softest first."""
    if loop.smooth:
        return Hysteresis(*loop.elements[0])
    torques, twists = np.array(loop.elements).T
    assert np.allclose(twists, twists[1] / np.array(STIFFNESSES))
    soft, middle, stiff = map(float, torques)
    springs = LoopSprings(1.0, soft / middle, stiff / middle, float(twists[1]))
    return Hysteresis(float(np.sum(torques)), float(twists[1]), springs)


def _transmission(item: PlantTransmission) -> Transmission:
    loop, stiffness = item.loop, item.stiffness if np.isfinite(item.stiffness) else None
    return Transmission(
        item.from_shaft,
        item.to_shaft,
        item.ratio,
        stiffness,
        item.damping,
        item.backlash,
        item.cubic,
        SecondStage(*item.second_stage, 0.0) if any(item.second_stage) else None,
        None if loop is None else _loop(loop),
        _wave(KinematicError, item.kinematic_error),
    )


def _motor(motor: PlantMotor, sensors: Sequence[PlantSensor]) -> Motor:
    """Return the motor of the plant, its recorded current being its command where a sensor measures that."""
    voltage, saturation = motor.drive == "voltage", motor.saturation
    assert saturation is None or saturation.form in ("algebraic", "cubic")
    cubic = saturation is not None and saturation.form == "cubic"
    return Motor(
        motor.name,
        motor.shaft,
        motor.torque_constant,
        motor.resistance if voltage else None,
        (motor.inductance or None) if voltage else None,
        motor.share,
        _wave(Cogging, motor.cogging),
        _wave(TorqueRipple, motor.torque_ripple),
        0.0 if motor.amplifier is None else motor.amplifier.time_constant,
        0.0 if saturation is None else saturation.current**-2.0 * (2.0 / 3.0 if cubic else 1.0),
        2.0 if saturation is None or cubic else saturation.sharpness,
        -1.0 if cubic else None,
        dead_time=0.0 if motor.amplifier is None else motor.amplifier.delay,
        lag_hidden=float(any(item.measures == f"{motor.name}.command" for item in sensors)),
    )


def _controller(controller: PlantController, output: str) -> Controller:
    return Controller(
        type=controller.type,
        feedback=controller.feedback,
        output=output,
        kp=controller.kp,
        ki=controller.ki,
        kd=controller.kd,
        sample_time=controller.sample_time,
        delay=controller.delay,
        saturation=controller.saturation if np.all(np.isfinite(controller.saturation)) else None,
        anti_windup=controller.anti_windup,
        derivative=controller.derivative,
    )


def drive_of(plant: Plant, inputs: Mapping[str, Trajectory | float]) -> Drive:
    """Return the drive under test: inputs by their signals; outputs are the plant's sensors, all angles and speeds."""
    driven = [Channel(name, name, "input") for name in inputs]
    sensors = [_eccentric(sensor) for sensor in plant.sensors]
    seen = [f"{shaft.name}.{signal}" for shaft in plant.shafts for signal in ("theta", "omega")]
    seen = [name for name in seen if name not in inputs]
    if any(c.type == "duty" for c in plant.controllers):
        driven.append(Channel("supply", f"{plant.motors[0].name}.supply_voltage", "input"))
    return Drive(
        shafts=tuple(_shaft(shaft) for shaft in plant.shafts),
        transmissions=tuple(_transmission(t) for t in plant.transmissions),
        motors=tuple(_motor(motor, plant.sensors) for motor in plant.motors),
        controller=_controller(plant.controllers[0], plant.motors[0].drive) if plant.controllers else None,
        channels=(*driven, *sensors, *(Channel(name, name) for name in seen)),
    )


@dataclass(frozen=True)
class Run:
    """Outputs and states of a free run by name, at the nodes."""

    time: np.ndarray
    values: Mapping[str, np.ndarray]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[name]


def _signal(trajectory: Trajectory | float) -> InputSignal:
    if isinstance(trajectory, Trajectory):
        return InputSignal(trajectory.time, trajectory.value, trajectory.hold == "zero")
    return InputSignal(np.zeros(1), np.array([float(trajectory)]), True)


@dataclass(frozen=True)
class Bench:
    """A stepped drive, to be run freely under any inputs, step by step in CasADi's virtual machine."""

    drive: Drive
    stepped: SteppedDrive = field(init=False)
    numbers: np.ndarray = field(init=False)
    """Values of the parameters in the order of the stepped drive."""
    _accumulated: dict[int, Any] = field(init=False, default_factory=dict[int, Any])
    """Steps put together by their number: a controller has as many from each of its ticks to the next."""

    def __post_init__(self) -> None:
        made = stepped(self.drive)
        values = {leaf.path: getattr(leaf.value, "guess", leaf.value) for leaf in drive_leaves(self.drive)}
        if self.drive.controller is not None:
            values["controller.feedback_delay"] = values[f"{self.drive.controller.feedback}.delay"]
        object.__setattr__(self, "stepped", made)
        object.__setattr__(self, "numbers", np.array([float(values[name]) for name in made.parameter_names]))

    def run(
        self,
        duration: float,
        inputs: Mapping[str, Trajectory | float],
        initial: Mapping[str, float] | None = None,
        step: float = 1e-3,
        every: float = 1e-3,
        width: float = 0.0,
    ) -> Run:
        """Run freely from `initial` (by state name, else zero) with samples `every` s and steps of at most `step` s."""
        samples = every * np.arange(round(duration / every) + 1)
        clock = Trajectory(np.array([0.0, duration]), np.array([0.0, duration]), "linear")
        signals = [_signal({TIME: clock, **inputs}[name]) for name in self.stepped.input_names]
        grid = build_grid(samples, signals, self.drive.controller, step)
        start = np.array([dict(initial or {}).get(name, 0.0) for name in self.stepped.state_names])
        widths = np.full(len(self.stepped.mechanism.topology.roots) + 1, width)
        states = self._states(grid, start, widths)
        h = np.append(grid.dt[:-1], grid.dt[-2]) / grid.substeps
        outputs = self.stepped.output.map(h.size)(states, grid.at_node.T, self.numbers, h, widths)
        at = np.searchsorted(grid.time, samples - 1e-9)
        columns = dict(zip(self.stepped.state_names, states, strict=True))
        columns |= dict(zip(self.stepped.output_names, np.asarray(outputs), strict=True))
        return Run(samples, {name: column[at] for name, column in columns.items()})

    def _states(self, grid: Grid, start: np.ndarray, widths: np.ndarray) -> np.ndarray:
        """Return (states, n) at the nodes: ticks as they fall due, then the steps up to the next tick at once."""
        states = np.empty((start.size, grid.time.size))
        due = np.unique(np.append(np.flatnonzero(grid.ticks), (0, grid.time.size - 1)))
        x: Any = start
        for first, last in zip(due, np.append(due[1:], due[-1]), strict=True):
            for kind in (APPLY, COMPUTE):
                if grid.ticks[first] & kind:
                    x = self.stepped.tick(x, grid.at_node[first], self.numbers, kind)
            states[:, first] = np.asarray(x).ravel()
            if last > first:
                count, inputs, h = _substeps(grid, first, last)
                passed = self._steps(h.size)(x, inputs, self.numbers, h, widths)
                states[:, first + 1 : last + 1] = np.asarray(passed)[:, np.cumsum(count) - 1]
                x = passed[:, -1]
        return states

    def _steps(self, number: int) -> Any:
        if number not in self._accumulated:
            self._accumulated[number] = self.stepped.step.mapaccum(number)
        return self._accumulated[number]


def _substeps(grid: Grid, first: int, last: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the number of steps in each interval, and the midpoint inputs and length of every step."""
    count = grid.substeps[first:last]
    interval = np.repeat(np.arange(first, last), count)
    share = (np.arange(interval.size) - np.repeat(np.cumsum(count) - count, count) + 0.5) / grid.substeps[interval]
    inputs = grid.at_start[interval] + share[:, None] * (grid.at_end[interval] - grid.at_start[interval])
    return count, inputs.T, grid.dt[interval] / grid.substeps[interval]


@dataclass(frozen=True)
class Twin:
    """The plant and the drive under test, driven alike."""

    plant: Plant
    inputs: Mapping[str, Trajectory | float]
    bench: Bench = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "bench", Bench(drive_of(self.plant, self.inputs)))

    def run(
        self, duration: float, initial: Mapping[str, float] | None = None, supply: float = 1.0, step: float = 1e-3
    ) -> tuple[Run, Run]:
        """Return the plant's truth and the free run of the drive, both every 1 ms from the same start."""
        initial = self._commanded() | dict(initial or {})
        ours_alone = ("controller.", ".lagged", ".delayed")
        first = {name: value for name, value in initial.items() if not any(part in name for part in ours_alone)}
        done = self.plant.simulate(duration, self.inputs, initial=first, truth_rate=1000, step=PLANT_STEP)
        recorded = {name: np.interp(done.truth["time"], *channel) for name, channel in done.channels.items()}
        truth = Run(done.truth["time"], done.truth | recorded)
        return truth, self.bench.run(duration, {**self.inputs, "supply": supply}, self._states(initial), step)

    def _commanded(self) -> dict[str, float]:
        """Return what the motors that are late begin with, as in the plant: their first commands."""
        begins: dict[str, float] = {}
        for motor in self.plant.motors:
            command = self.inputs.get(f"{motor.name}.{motor.drive}", 0.0)
            begin = float(command.value[0]) if isinstance(command, Trajectory) else command
            begins |= {f"{motor.name}.{state}": motor.share * begin for state in (*DELAYED, "lagged")}
        return begins

    def _states(self, initial: Mapping[str, float]) -> dict[str, float]:
        return {re.sub(r"\.z(\d*)$", r".friction.z\1", name): value for name, value in initial.items()}


def worst(truth: Run, ours: Run, *names: str) -> float:
    """Return the largest deviation over signals, each relative to the largest value of the truth."""
    deviations = [np.max(np.abs(ours[name] - truth[name])) / np.max(np.abs(truth[name])) for name in names]
    return float(np.max(deviations))

"""The plant: parts, and the run that turns inputs into recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from .assembly import Mechanics, assemble_mechanics, check_step, group_traits, motor_rows
from .flaw_rows import added_stiffness, amplifier_rows, joint_rows, ripple_rows, shaft_rows
from .layout import MODEL, STATE
from .parts import PlantController, PlantMotor, PlantSensor, PlantShaft, PlantTransmission
from .sampling import ControllerArrays, SensorArrays, collect, draw_samples, lay_out_controllers, lay_out_sensors
from .stepping import run
from .trajectories import Trajectory, TrajectoryLike, as_trajectory

SHAFT_INPUTS = ("external_torque", "omega", "friction_factor", "added_coulomb")
CHUNK = 1 << 15
"""Steps per kernel call; bounds the memory of the process noise."""


@dataclass(frozen=True)
class PlantRun:
    """Recordings {channel: (time, values)} and, where asked for, the true states on their own grid.

    `truth` has `time` and `<shaft>.theta|omega|alpha|friction|z`, `<from>-<to>.torque` of elastic joints (output side),
    `<motor>.current`. alpha, friction and torque are means of the step that ends at `time`, zero in the first row.
    """

    channels: dict[str, tuple[np.ndarray, np.ndarray]]
    truth: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class Plant:
    """A drive: shafts joined by transmissions, with motors, controllers and sensors."""

    shafts: tuple[PlantShaft, ...]
    transmissions: tuple[PlantTransmission, ...] = ()
    motors: tuple[PlantMotor, ...] = ()
    controllers: tuple[PlantController, ...] = ()
    sensors: tuple[PlantSensor, ...] = ()

    def simulate(
        self,
        duration: float,
        inputs: Mapping[str, TrajectoryLike] | None = None,
        rng: np.random.Generator | None = None,
        *,
        step: float = 2e-5,
        process_noise: Mapping[str, float] | None = None,
        initial: Mapping[str, float] | None = None,
        truth_rate: float = 0.0,
    ) -> PlantRun:
        """Simulate `duration` seconds.

        `inputs` are `<motor>.current|torque|voltage` (by its drive), `<motor>.enable`, `<shaft>.external_torque`,
        `<shaft>.omega` (prescribes the speed), `<shaft>.friction_factor`, `<shaft>.added_coulomb` (dry friction on top,
        N m), `reference.theta|omega`: a Trajectory, (time, values) held, or a number.
        `process_noise` is the density of white torque per shaft in N m/sqrt(Hz): the speed of a free
        inertia J gathers the variance density^2 t / J^2. `initial` is `<shaft>.theta|omega|z|warmth`.
        `truth_rate` in Hz.
        """
        signals = {name: as_trajectory(value) for name, value in (inputs or {}).items()}
        self._check_names(signals, process_noise or {}, initial or {})
        drawn = [draw_samples(s, duration, rng, self.shafts, self.motors, signals) for s in self.sensors]
        mechanics = assemble_mechanics(self.shafts, self.transmissions)
        sensors = lay_out_sensors([samples for samples in drawn if samples.place is not None], step)
        loops = lay_out_controllers(self.controllers, drawn, signals, duration, step)
        model = _fill(MODEL, vars(mechanics) | vars(sensors) | vars(loops) | _tape_places(signals))
        model["truth_every"] = round(1.0 / (truth_rate * step)) if truth_rate > 0 else 0
        measured = [samples.sensor for samples in drawn if samples.place is not None]
        self._connect(model, mechanics, list(signals), step, process_noise or {}, measured)
        state = _fill(STATE, {"signal_at": model["signal"][0, :-1], "sensor_at": model["sample"][0, :-1, None]})
        _start(self.shafts, mechanics, state, signals, initial or {})
        truth = self._run(model, state, sensors, loops, signals, duration, rng)
        return PlantRun(collect(drawn, sensors, signals), self._name_truth(model, truth))

    def _check_names(
        self, signals: Mapping[str, Trajectory], noise: Mapping[str, float], initial: Mapping[str, float]
    ) -> None:
        shafts = [shaft.name for shaft in self.shafts]
        known = [f"{motor.name}.{signal}" for motor in self.motors for signal in (motor.drive, "enable")]
        known += [f"{shaft}.{signal}" for shaft in shafts for signal in SHAFT_INPUTS]
        known += [f"{c.reference}.{signal}" for c in self.controllers for signal in ("theta", "omega")]
        states = [f"{shaft}.{signal}" for shaft in shafts for signal in ("theta", "omega", "z", "warmth")]
        for given, allowed, what in (
            (signals, known, "input"),
            (noise, shafts, "noise on"),
            (initial, states, "initial"),
        ):
            for name in given:
                if name not in allowed:
                    raise ValueError(f"plant: no {what} '{name}'; there are {', '.join(allowed)}")

    def _connect(
        self,
        model: np.ndarray,
        mechanics: Mechanics,
        inputs: list[str],
        step: float,
        noise: Mapping[str, float],
        sensors: list[PlantSensor],
    ) -> None:
        """Fill in what depends on the inputs and the step."""
        columns = {name: index for index, name in enumerate(inputs)}
        names = [shaft.name for shaft in self.shafts]
        prescribed = {i: columns[f"{name}.omega"] for i, name in enumerate(names) if f"{name}.omega" in columns}
        joints = [part for part in self.transmissions if np.isfinite(part.stiffness)]
        flaws = ripple_rows(self.shafts, joints, self.motors, sensors) | shaft_rows(self.shafts, columns)
        flaws |= joint_rows(joints) | amplifier_rows(self.motors, step)
        traits = group_traits(mechanics, prescribed, [f"{name}.added_coulomb" in columns for name in names])
        extra = np.array([added_stiffness(part) for part in joints])
        check_step(mechanics, traits, step, extra, np.asarray(flaws["bumper"]))
        motor, winding = motor_rows(self.motors, self.shafts, columns, [c.name for c in self.controllers])
        values = {
            "step": step,
            "groups": mechanics.group_inertia.size,
            "shafts": len(names),
            "joints": mechanics.joint.shape[0],
            "motors": len(self.motors),
            "inputs": len(inputs),
            "controllers": len(self.controllers),
            "traits": traits,
            "motor": motor,
            "winding": winding,
            "external": [columns.get(f"{name}.external_torque", -1) for name in names],
            "noise_std": [noise.get(name, 0.0) / np.sqrt(step) for name in names],
        }
        for name, value in (values | flaws).items():
            _put(model, name, value)

    def _run(
        self,
        model: np.ndarray,
        state: np.ndarray,
        sensors: SensorArrays,
        loops: ControllerArrays,
        signals: Mapping[str, Trajectory],
        duration: float,
        rng: np.random.Generator | None,
    ) -> np.ndarray:
        step, every, shafts = float(model["step"][0]), int(model["truth_every"][0]), len(self.shafts)
        tapes = [np.concatenate([np.zeros(0), *(getattr(s, k) for s in signals.values())]) for k in ("time", "value")]
        references = (loops.reference, np.zeros(len(loops.reference)))
        samples = (sensors.sample_step, sensors.sample_fraction, sensors.sample_ready)
        truth = _first_truth(model, state, int(np.floor(duration / (every * step) + 1e-9)) + 1 if every else 0)
        noisy = bool(np.any(model["noise_std"] > 0))
        if noisy and rng is None:
            raise ValueError("plant: process noise needs rng")
        steps = int(np.ceil(duration / step - 1e-6)) + 2
        for begin in range(0, steps, CHUNK):
            end = min(begin + CHUNK, steps)
            noise = rng.standard_normal((end - begin, shafts)) if noisy and rng is not None else np.zeros((1, shafts))
            run(model, state, tuple(tapes), references, samples, sensors.recorded, truth, noise, begin, end)
        return truth

    def _name_truth(self, model: np.ndarray, truth: np.ndarray) -> dict[str, np.ndarray]:
        if not truth.size:
            return {}
        names = [f"{shaft.name}.{s}" for s in ("theta", "omega", "alpha", "friction", "z") for shaft in self.shafts]
        names += [f"{part.name}.torque" for part in self.transmissions if np.isfinite(part.stiffness)]
        names += [f"{motor.name}.current" for motor in self.motors]
        time = np.arange(truth.shape[0]) * (model["truth_every"][0] * model["step"][0])
        return {"time": time} | {name: truth[:, k].copy() for k, name in enumerate(names)}


def _put(record: np.ndarray, name: str, value: object) -> None:
    array, target = np.asarray(value), record[name][0]
    if array.ndim == 0:
        record[name] = array
    elif array.shape[0] > target.shape[0]:
        raise ValueError(f"plant: {array.shape[0]} rows of {name}, the kernels have room for {target.shape[0]}")
    else:
        target[: array.shape[0]] = array


def _fill(dtype: np.dtype, values: Mapping[str, object]) -> np.ndarray:
    record = np.zeros(1, dtype)
    for name, value in values.items():
        if name in (dtype.names or ()):
            _put(record, name, value)
    return record


def _tape_places(signals: Mapping[str, Trajectory]) -> dict[str, object]:
    return {
        "signal": np.concatenate(([0], np.cumsum([s.time.size for s in signals.values()]))),
        "signal_linear": [int(s.hold == "linear") for s in signals.values()],
    }


def _start(
    shafts: tuple[PlantShaft, ...],
    mechanics: Mechanics,
    state: np.ndarray,
    signals: Mapping[str, Trajectory],
    initial: Mapping[str, float],
) -> None:
    names = [shaft.name for shaft in shafts]
    keys = [f"{name}.omega" for name in names if f"{name}.omega" in signals]
    for key, value in (dict(initial) | {key: float(signals[key].at(np.zeros(1))[0]) for key in keys}).items():
        name, _, signal = key.rpartition(".")
        i = names.index(name)
        g, scale = mechanics.group[i], mechanics.scale[i]
        if signal == "z":
            state["bristle"][0, i, 0] = value
        elif signal == "warmth":
            state["warmth"][0, i] = value
        else:
            state[signal][0, g, :] = value / scale


def _first_truth(model: np.ndarray, state: np.ndarray, rows: int) -> np.ndarray:
    shafts = int(model["shafts"][0])
    truth = np.zeros((rows, 5 * shafts + int(model["joints"][0]) + int(model["motors"][0])))
    if rows:
        scale, group = model["scale"][0, :shafts], model["group"][0, :shafts]
        truth[0, :shafts] = scale * state["theta"][0, group, 0]
        truth[0, shafts : 2 * shafts] = scale * state["omega"][0, group, 0]
        truth[0, 4 * shafts : 5 * shafts] = state["bristle"][0, :shafts, 0]
    return truth

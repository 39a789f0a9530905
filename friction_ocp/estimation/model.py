"""A problem made ready to compute: model functions, time grids, noise floors, scales."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from friction_ocp.drive.parts import Drive
from friction_ocp.drive.steady import steady_speeds
from friction_ocp.drive.stepping import SteppedDrive, stepped
from friction_ocp.drive.values import bind_drive
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.clocks import on_one_clock
from friction_ocp.estimation.experiment import Experiment, experiment, with_inputs
from friction_ocp.estimation.lateness import lateness, read_earlier
from friction_ocp.estimation.modes import integrator_step
from friction_ocp.estimation.noise import NoiseFloor, NoiseLevel, noise_floor
from friction_ocp.estimation.parameter_space import ParameterSpace, parameter_space
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.estimation.static_points import StaticTerm, static_term
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.sweep import Sweep, sweep_of

MOST_OF_ANOTHER = 100
"""The same for what is added to a drive, whose guesses suit a fit that may lie far from those of the rest."""
SHORTENED = 16.0
"""How many times shorter parameters that a fit has found make steps at most: a spring may be absurd on the way."""


@dataclass(frozen=True)
class SpeedRange:
    """Speeds of one shaft, on its own side."""

    typical: float
    """Root mean square, rad/s."""
    top: float
    """Largest magnitude, rad/s."""


@dataclass(frozen=True)
class Model:
    """Everything that a fit or a simulation of a problem needs."""

    problem: Problem
    drive: SteppedDrive
    space: ParameterSpace
    sweep: Sweep
    train: tuple[Experiment, ...]
    validation: tuple[Experiment, ...]
    floors: Mapping[str, NoiseFloor]
    speed_scale: FloatArray
    """(groups + 1,) typical speed of each group and 1 for the backlash corners, to scale the smoothing."""
    state_scale: FloatArray
    """(states,) typical size of each state."""
    speeds: Mapping[str, SpeedRange]
    """How fast each shaft turns in training recordings and static points, by its name."""
    max_step: float
    """Longest integrator step, s."""
    static: tuple[StaticTerm, ...] = ()
    """Static points that are fitted."""
    static_validation: tuple[StaticTerm, ...] = ()
    noise_levels: tuple[NoiseLevel, ...] = ()
    """Torque noise that was estimated."""
    found: Mapping[str, float] = field(default_factory=dict[str, float])
    """Parameters that gaps between segments and sizes of states are laid for, by name; guesses of those it lacks."""
    noisy_inputs: tuple[str, ...] = ()
    """Measured inputs whose noise moves a channel, within two samples, by more than the channel's own."""
    tells_noise: bool = False
    """Whether fits end with programs in which that noise is an unknown of every sample."""
    joins_noise: bool = False
    """Whether the noise of measured inputs joins segments, and no torque noise that is stated."""
    lost_free_run: bool = False
    """Whether it does so because fits of free runs leave more than noise, or lead to no end."""

    @property
    def nominal(self) -> FloatArray:
        """(parameters,) what gaps between segments and sizes of states are laid for."""
        return self.space.with_known(self.found)

    @property
    def process_noise(self) -> Mapping[str, float]:
        """Torque noise by shaft, N m/sqrt(Hz): stated, guessed or estimated."""
        return {**self.problem.estimation.process_noise, **{item.shaft: item.value for item in self.noise_levels}}

    @property
    def noise(self) -> FloatArray:
        """(outputs,) noise floors."""
        return np.array([self.floors[name].std for name in self.drive.output_names])


def prepare(problem: Problem) -> Model:
    """Build model functions, grids and scales; raises FrictionOcpError where recordings do not fit the drive."""
    problem = _as_stamped(on_one_clock(problem))
    drive = stepped(problem.drive)
    space = parameter_space(problem, drive.parameter_names)
    sweep = sweep_of(problem.drive, tuple(space.active))
    max_step = problem.estimation.max_step or integrator_step(drive, space, problem)
    uses = [_try_experiment(use, drive, problem, max_step) for use in problem.recordings]
    findings = [finding for use in uses if isinstance(use, FrictionOcpError) for finding in use.findings]
    if findings:
        raise FrictionOcpError(findings)
    experiments = [use for use in uses if isinstance(use, Experiment)]
    train = tuple(experiments[: len(problem.train)])
    floors = {channel.name: noise_floor(channel, _signals(problem, channel.name)) for channel in problem.drive.outputs}
    states = np.concatenate(
        [np.zeros((0, len(drive.state_names))), *(_suggested(sweep, space, item, space.guess) for item in train)]
    )
    static = tuple(static_term(use, problem.drive, space) for use in problem.static)
    model = Model(
        problem=problem,
        drive=drive,
        space=space,
        sweep=sweep,
        train=train,
        validation=tuple(experiments[len(problem.train) :]),
        floors=floors,
        speed_scale=_speed_scale(drive, states) if train else _scale_of_points(drive, static),
        state_scale=_state_scale(states),
        speeds=_wider(_speeds(drive, space, problem, states), _speeds_of_points(space, problem, static)),
        max_step=max_step,
        static=static,
        static_validation=tuple(static_term(use, problem.drive, space) for use in problem.static_validation),
    )
    return in_time(model, space.guess)


def _as_stamped(problem: Problem) -> Problem:
    """Return a problem of which no channel is read earlier than its stamps say."""
    train, validation = (tuple(replace(use, late={}) for use in uses) for uses in (problem.train, problem.validation))
    return replace(problem, train=train, validation=validation)


def in_time(model: Model, theta: FloatArray, channels: Collection[str] | None = None) -> Model:
    """Return a model that reads late channels where what they show was true, with the delays that `theta` gives them.

    The same model where it does. What is left of a delay, less than an interval between nodes, is expanded. Where
    `channels` are stated all others are read as they were.
    """
    items = {item.name: item for item in (*model.train, *model.validation)}
    late: dict[str, dict[str, float]] = {}
    for use in model.problem.recordings:
        left = model.space.numbers_by_path(theta, use.name)
        known = {name: use.late.get(name, 0.0) for name in model.drive.output_names}
        delays = {
            name: undone + (left[f"{name}.delay"] if channels is None or name in channels else 0.0)
            for name, undone in known.items()
        }
        late[use.name] = lateness(items[use.name], delays, use.late)
    return with_late(model, late)


def late_of(model: Model) -> dict[str, Mapping[str, float]]:
    """Return by recording what reading late channels earlier undoes of their delays, s."""
    return {use.name: use.late for use in model.problem.recordings if use.late}


def with_late(model: Model, late: Mapping[str, Mapping[str, float]]) -> Model:
    """Return a model that reads channels earlier by stated times, s, by recording; noise, steps and start stay."""
    if all(use.late == late.get(use.name, {}) for use in model.problem.recordings):
        return model
    train, validation = (
        tuple(replace(use, late=late.get(use.name, {})) for use in uses)
        for uses in (model.problem.train, model.problem.validation)
    )
    problem, names = replace(model.problem, train=train, validation=validation), model.drive.output_names
    return replace(
        model,
        problem=problem,
        space=parameter_space(problem, model.space.leaf_names).moved(model.space.guess),
        train=tuple(read_earlier(item, names, late.get(item.name, {})) for item in model.train),
        validation=tuple(read_earlier(item, names, late.get(item.name, {})) for item in model.validation),
    )


def prepare_fit(problem: Problem) -> Model:
    """Prepare a problem that is to be fitted; raises FrictionOcpError also where nothing has a guess."""
    model = prepare(problem)
    if not model.space.names:
        where = str(problem.path or problem.title)
        raise FrictionOcpError(Finding(where, "nothing to fit", "a parameter with {guess: ...} is fitted"))
    return model


def with_drive(model: Model, drive: Drive) -> Model:
    """Return the same recordings seen by another drive of the same channels; floors and node times stay."""
    problem = replace(model.problem, drive=drive)
    after = stepped(drive)
    space = parameter_space(problem, after.parameter_names)
    sweep = sweep_of(drive, tuple(space.active))
    max_step = model.max_step
    if model.problem.estimation.max_step is None:
        max_step = min(max_step, integrator_step(after, space, problem, MOST_OF_ANOTHER))
    train, validation = (
        tuple(_with_step(seen_by(model, after, item), max_step, model.max_step) for item in items)
        for items in (model.train, model.validation)
    )
    states = np.concatenate([_suggested(sweep, space, item, space.guess) for item in train])
    seen = replace(
        model,
        problem=problem,
        drive=after,
        space=space,
        sweep=sweep,
        train=train,
        validation=validation,
        speed_scale=_speed_scale(after, states),
        state_scale=_state_scale(states),
        max_step=max_step,
        static=tuple(static_term(use, drive, space) for use in problem.static),
        static_validation=tuple(static_term(use, drive, space) for use in problem.static_validation),
    )
    known = drive.recorded_late is None and all(isinstance(motor.dead_time, (int, float)) for motor in drive.delaying)
    stated = [channel.name for channel in drive.outputs if known and isinstance(channel.delay, (int, float))]
    return in_time(seen, space.guess, stated)


def with_step(model: Model, max_step: float) -> Model:
    """Return a model with shorter integrator steps, s."""
    train, validation = (
        tuple(_with_step(item, max_step, model.max_step) for item in items) for items in (model.train, model.validation)
    )
    return replace(model, train=train, validation=validation, max_step=max_step)


def resolving(model: Model, theta: FloatArray) -> Model:
    """Return a model whose integrator steps resolve the fastest mode at some parameters; the same if its own do."""
    if model.problem.estimation.max_step is not None or not model.train:
        return model
    step = integrator_step(model.drive, model.space.moved(theta), model.problem, MOST_OF_ANOTHER)
    step = max(step, model.max_step / SHORTENED)
    return with_step(model, step) if step < model.max_step else model


def step_at_guesses(model: Model) -> float:
    """Return the integrator step, s, that the fastest mode at the guesses asks for."""
    return integrator_step(model.drive, model.space, model.problem)


def laid_for(model: Model, found: Mapping[str, float]) -> Model:
    """Return a model whose gaps between segments and sizes of states are those that parameters by name call for."""
    after = replace(model, found=dict(found))
    states = [_suggested(model.sweep, model.space, item, after.nominal) for item in model.train]
    return replace(after, state_scale=_state_scale(np.concatenate(states))) if states else after


def seen_by(model: Model, drive: SteppedDrive, item: Experiment, known: Sequence[str] | None = None) -> Experiment:
    """Return a recording, or a piece of one, with the inputs of another drive of the same channels.

    `known` are the inputs that it has; None for those of the model.
    """
    use = next(use for use in model.problem.recordings if use.name == item.name)
    read = read_earlier(item, drive.output_names, use.late)
    return with_inputs(read, model.drive.input_names if known is None else known, drive.input_names, use.recording)


def _with_step(item: Experiment, max_step: float, known: float) -> Experiment:
    if max_step >= known:
        return item
    return replace(item, grid=item.grid.with_step(max_step))


def _try_experiment(
    use: RecordingUse, drive: SteppedDrive, problem: Problem, max_step: float
) -> Experiment | FrictionOcpError:
    try:
        return experiment(use, drive, problem.drive.inputs, max_step)
    except FrictionOcpError as error:
        return error


def _signals(problem: Problem, name: str) -> list[tuple[FloatArray, FloatArray]]:
    channels = [use.recording.channels[name] for use in problem.recordings]
    return [(channel.time, channel.values) for channel in channels]


def _suggested(sweep: Sweep, space: ParameterSpace, item: Experiment, theta: FloatArray) -> FloatArray:
    return sweep.start_states(item.signals(slice(None)), space.numbers(theta, item.name))


def _scale_of_points(drive: SteppedDrive, static: tuple[StaticTerm, ...]) -> FloatArray:
    """Return the speed scale where there are static points alone: their typical speed for every group."""
    speeds = np.concatenate([term.speed for term in static])
    typical = float(np.sqrt(np.mean(speeds**2))) or 1.0
    scale = np.ones(len(drive.mechanism.topology.roots) + 1)
    scale[:-1] = typical
    return scale


def _state_scale(states: FloatArray) -> FloatArray:
    spread = np.std(states, axis=0) if states.size else np.zeros_like(states, shape=states.shape[1:])
    return np.where(spread > 0, spread, 1.0)


def _speed_scale(drive: SteppedDrive, states: FloatArray) -> FloatArray:
    mech = drive.mechanism
    first = len(mech.angle_groups)
    scale = np.ones(len(mech.topology.roots) + 1)
    for k, group in enumerate(mech.free_groups):
        speed = float(np.sqrt(np.mean(states[:, first + k] ** 2)))
        scale[group] = speed if speed > 0 else 1.0
    return scale


def _speeds(drive: SteppedDrive, space: ParameterSpace, problem: Problem, states: FloatArray) -> dict[str, SpeedRange]:
    """Return the range of speeds of every shaft whose speed is a state."""
    if not problem.train:
        return {}
    mech = drive.mechanism
    numbers = space.numbers(space.guess, problem.train[0].name)
    first, ranges = len(mech.angle_groups), dict[str, SpeedRange]()
    for k, group in enumerate(mech.free_groups):
        speed = np.abs(states[:, first + k])
        names = mech.topology.members(group)
        ratios = ca.vertcat(*[ca.SX(mech.topology.speed_ratio[name]) for name in names])
        by_name = ca.Function("ratios", [ca.vertcat(*mech.parameters.values())], [ratios])(numbers)
        for name, ratio in zip(names, np.abs(np.asarray(by_name)).ravel(), strict=True):
            ranges[name] = SpeedRange(float(np.sqrt(np.mean(speed**2)) * ratio), float(np.max(speed) * ratio))
    return ranges


def _speeds_of_points(space: ParameterSpace, problem: Problem, static: tuple[StaticTerm, ...]) -> dict[str, SpeedRange]:
    """Return the range of speeds of every shaft over all static points, through springs as if they were rigid."""
    if not static:
        return {}
    numbers = space.numbers_by_path(space.guess, static[0].name)
    speed = np.abs(np.concatenate([term.speed for term in static]))
    typical, top = float(np.sqrt(np.mean(speed**2))), float(np.max(speed))
    ratios = steady_speeds(bind_drive(problem.drive, numbers))
    return {name: SpeedRange(abs(ratio) * typical, abs(ratio) * top) for name, ratio in ratios.items()}


def _wider(first: dict[str, SpeedRange], second: dict[str, SpeedRange]) -> dict[str, SpeedRange]:
    """Return for every shaft the larger of two typical and of two top speeds."""
    both = {name: [table[name] for table in (first, second) if name in table] for name in {**first, **second}}
    return {
        name: SpeedRange(max(item.typical for item in items), max(item.top for item in items))
        for name, items in both.items()
    }

"""Ipopt and Gauss-Newton find the same answers."""

from __future__ import annotations

import signal
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, steps_and_multisine
from smooth_programs import offset_rosenbrock, rosenbrock, toy

from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.ipopt import solve_ipopt
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.problem import EstimationOptions, Problem, RecordingUse
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.stages import free_run, relaxed
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel as Recorded
from friction_ocp.recording.recording import Recording
from friction_ocp.simulation.losses import Squares

AGREEMENT = 1e-6
"""Both solvers stop where less than 1e-7 of the objective is left to gain."""
TIGHT = Tolerances(decrease=1e-12, negligible=0.0, progress=1e-10)


def recording(seed: int) -> RecordingUse:
    """Return a second of a mass with Coulomb and viscous friction."""
    rng = np.random.default_rng(seed)
    friction = PlantFriction("coulomb_viscous", tau_c=0.1, viscous=0.02)
    plant = Plant(
        (PlantShaft("motor", 0.01, friction),),
        motors=(PlantMotor("motor", "motor", "torque"),),
        sensors=(
            PlantSensor("torque", "motor.torque", 2e-3, noise_std=2e-3),
            PlantSensor("angle", "motor.theta", 2e-3, noise_std=1e-4),
        ),
    )
    torque = steps_and_multisine(np.array([0.2, 0.4]), (0.05, 0.15), 0.1, (1.0, 20.0), 1.0, rng)
    done = plant.simulate(1.0, {"motor.torque": torque}, rng, process_noise={"motor": 1e-4})
    units = {"torque": "N m", "angle": "rad"}
    channels = {name: Recorded(name, *series, units[name]) for name, series in done.channels.items()}
    return RecordingUse(Recording(f"run{seed}", channels))


@pytest.fixture(scope="module")
def model() -> Model:
    """A problem with three unknown numbers and two recordings."""
    law = CoulombViscous(Free(0.05, 0.0, 1.0), Free(0.05, 0.0, 1.0))
    drive = Drive(
        (Shaft("motor", Free(0.02, 1e-3, 1.0), FrictionElement(law)),),
        motors=(Motor("motor", "motor"),),
        channels=(Channel("torque", "motor.torque", "input"), Channel("angle", "motor.theta", noise_std=1e-4)),
    )
    options = EstimationOptions(process_noise={"motor": 1e-3})
    return prepare(Problem("one mass", drive, (recording(0), recording(1)), estimation=options))


def start(program: Program) -> Point:
    """Return the guesses with the nodes that the measurement suggests."""
    return suggested_point(program, program.space.guess)


@pytest.mark.parametrize("kind", ["relaxed", "free run", "free run in windows", "measured starts"])
def test_agrees_with_gauss_newton(model: Model, kind: str) -> None:
    """On smoothed problems both end at the same objective and the same parameters."""
    if kind == "relaxed":
        program = relaxed(model, model.train, 0.1, Squares())
    else:
        horizon = 0.25 if kind == "free run in windows" else None
        program = free_run(model, model.train, 0.1, Squares(), horizon)
    if kind == "measured starts":
        held = tuple(replace(cut, measured=1, start_weight=None) for cut in program.segments)
        program = replace(program, segments=held)
    ours, theirs = (solve(program, start(program), TIGHT) for solve in (solve_gauss_newton, solve_ipopt))
    assert ours.converged and theirs.converged
    assert theirs.objective == pytest.approx(ours.objective, rel=AGREEMENT)
    assert theirs.point.theta == pytest.approx(ours.point.theta, rel=1e-3)


def test_recovers_the_truth(model: Model) -> None:
    """The relaxed problem without smoothing gives the plant's numbers."""
    program = relaxed(model, model.train, 0.0, Squares())
    found = dict(zip(program.space.names, solve_ipopt(program, start(program)).point.theta, strict=True))
    assert found["motor.inertia"] == pytest.approx(0.01, rel=0.05)
    assert found["motor.friction.tau_c"] == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize("upper", [np.inf, 0.5])
@pytest.mark.parametrize("constrained", [False, True])
def test_bounds_and_constraints_agree(upper: float, constrained: bool) -> None:
    """Active bounds and constraints are found alike."""
    limit = (lambda theta: 0.8 - theta[0] - theta[1]) if constrained else None
    program: Any = toy(offset_rosenbrock, (-1.2, 0.3), -2.0, upper, limit)
    ours, theirs = (solve(program, program.start, TIGHT) for solve in (solve_gauss_newton, solve_ipopt))
    assert ours.converged and theirs.converged
    assert theirs.point.theta == pytest.approx(ours.point.theta, abs=1e-4)
    assert theirs.objective == pytest.approx(ours.objective, rel=AGREEMENT)


def test_what_lies_at_a_bound_is_on_it() -> None:
    """The small distance that Ipopt keeps from active bounds is closed."""
    program: Any = toy(offset_rosenbrock, (-1.2, 0.3), -2.0, 0.5)
    assert solve_ipopt(program, program.start, TIGHT).point.theta[0] == 0.5


def test_iteration_limit_is_not_convergence() -> None:
    """A solver that was cut short names the parameter that still moves."""
    program: Any = toy(rosenbrock, (-1.2, 1.0))
    solution = solve_ipopt(program, program.start, Tolerances(max_iterations=2))
    assert not solution.converged
    assert "iteration limit" in solution.message and "theta" in solution.message


def test_contradicting_constraints_are_no_answer() -> None:
    """Constraints that exclude each other are reported."""
    program: Any = toy(rosenbrock, (0.2, 0.2), -1, 1, lambda theta: ca.vertcat(theta[0] - 0.5, -theta[0] - 0.5))
    assert not solve_ipopt(program, program.start).converged


def test_breakdown_at_the_start_is_reported() -> None:
    """Where the first evaluation is not finite there is no answer."""
    program: Any = toy(lambda theta: ca.log(theta), (-1.0,))
    assert "breaks down" in solve_ipopt(program, program.start).message


@pytest.mark.parametrize("ctrl_c", [True, False])
def test_interrupt_is_raised_after_the_iterate(ctrl_c: bool) -> None:
    """A KeyboardInterrupt, from the keyboard or from `watch`, ends Ipopt at once and comes out."""
    program: Any = toy(rosenbrock, (-1.2, 1.0))
    seen: list[int] = []

    def watch(iteration: int, objective: float, point: Point) -> None:
        seen.append(iteration)
        if iteration == 3:
            if not ctrl_c:
                raise KeyboardInterrupt
            signal.raise_signal(signal.SIGINT)

    before = signal.default_int_handler
    inherited = signal.signal(signal.SIGINT, before)  # shells that start a job in the background have it ignored
    try:
        with pytest.raises(KeyboardInterrupt):
            solve_ipopt(program, program.start, watch=watch)
        assert signal.getsignal(signal.SIGINT) is before
    finally:
        signal.signal(signal.SIGINT, inherited)
    assert seen == [1, 2, 3]


def test_errors_of_the_program_come_out() -> None:
    """An exception inside an evaluation is raised, not swallowed by Ipopt."""
    program: Any = toy(rosenbrock, (-1.2, 1.0))
    evaluate, calls = program.linearise, [0]

    class Failing:
        space, segments = program.space, ()

        def linearise(self, point: Point) -> Any:
            calls[0] += 1
            if calls[0] > 5:
                raise ZeroDivisionError("in the model")
            return evaluate(point)

    failing: Any = Failing()
    with pytest.raises(ZeroDivisionError):
        solve_ipopt(failing, program.start)
    assert calls[0] == 6


def test_nothing_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    """Ipopt stays silent."""
    program: Any = toy(rosenbrock, (-1.2, 1.0))
    solve_ipopt(program, program.start)
    assert capfd.readouterr() == ("", "")

"""How recordings are cut into segments and windows, and what a program does with them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from axes import INERTIA, axis, fitted_axis, problem, still_recording
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.estimation.first_nodes import suggested_nodes, suggested_point
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.stages import cuts, free_run, mean_error, predictions, relaxed, windows
from friction_ocp.parameters import Free
from friction_ocp.simulation.losses import Squares

steps = st.floats(1e-3, 2e-2)


def recorded(time: np.ndarray) -> Any:
    """Return something with a time grid."""
    return SimpleNamespace(grid=SimpleNamespace(time=time))


@given(st.integers(2, 3000), st.integers(1, 400))
def test_segments_cover_a_recording_evenly(nodes: int, samples: int) -> None:
    """They begin at the first node, end at the last, and are all as long as asked but for the last."""
    first = cuts(recorded(np.arange(nodes, dtype=float)), samples)
    lengths = np.diff(first)
    assert (first[0], first[-1]) == (0, nodes - 1)
    assert np.all(lengths[:-1] == samples)
    assert lengths[-1] <= 1.5 * samples
    assert len(lengths) == 1 or lengths[-1] >= 0.5 * samples


@given(st.lists(steps, min_size=20, max_size=300), st.floats(0.05, 5.0))
def test_windows_cover_a_recording_at_any_rate(intervals: list[float], horizon: float) -> None:
    """However irregular its samples, every window is as long as the others to within two samples."""
    time = 3.0 + np.cumsum(intervals)
    first = windows(recorded(time), horizon)
    duration = time[-1] - time[0]
    assert (first[0], first[-1]) == (0, time.size - 1)
    even = duration / max(1, round(duration / horizon))
    assert np.all(np.abs(np.diff(time[first]) - even) <= 2.0 * max(intervals))


def test_without_a_horizon_there_is_one_window() -> None:
    """The whole recording."""
    assert windows(recorded(np.arange(50.0)), None).tolist() == [0, 49]


@pytest.fixture(scope="module")
def model() -> Model:
    """One free shaft, two recordings."""
    return prepare(problem(axis(inertia=Free(INERTIA)), still_recording("a"), still_recording("b", 300), segment=60))


def test_relaxed_segments_are_joined_by_gaps(model: Model) -> None:
    """Each but the last is weighted against the next; only the first is tied to the measurement."""
    program = relaxed(model, model.train, 0.0, Squares())
    assert [cut.count for cut in program.segments] == [8, 5]
    for cut in program.segments:
        assert cut.gap_weight is not None and cut.gap_weight.shape == (cut.count - 1, 2, 2)
        assert cut.tied.tolist() == [0]


def test_predictions_start_from_the_measurement(model: Model) -> None:
    """No state is a variable: the program is one in the parameters alone."""
    program = predictions(model, model.train, 0.0)
    assert all(cut.measured == cut.count and cut.gap_weight is None for cut in program.segments)


def test_a_relaxed_program_of_one_segment_is_the_free_run(model: Model) -> None:
    """Where there are no gaps both have the same objective and gradient."""
    whole = prepare(problem(axis(inertia=Free(INERTIA)), still_recording("a"), segment=10_000))
    programs = (relaxed(whole, whole.train, 0.0, Squares()), free_run(whole, whole.train, 0.0, Squares(), None))
    point = Point(1.3 * whole.space.guess, suggested_nodes(programs[0], whole.space.guess))
    one, other = (program.linearise(point) for program in programs)
    assert one.objective == pytest.approx(other.objective)
    assert one.theta_gradient == pytest.approx(other.theta_gradient)


@pytest.mark.parametrize("kind", ["relaxed", "free_run", "predictions"])
def test_the_gradient_is_that_of_the_objective(kind: str) -> None:
    """Parameters and node states: analytic derivatives against central differences of the cost."""
    model = prepare(fitted_axis(still_recording("a", 200), segment=60))
    builders: dict[str, Any] = {
        "relaxed": lambda: relaxed(model, model.train, 0.1, Squares()),
        "free_run": lambda: free_run(model, model.train, 0.1, Squares(), 0.15),
        "predictions": lambda: predictions(model, model.train, 0.1),
    }
    program = builders[kind]()
    point = suggested_point(program, model.space.guess)
    system = program.linearise(point)
    assert system.objective == pytest.approx(program.objective(point))
    for k, size in enumerate(1e-6 * model.space.guess):
        ahead, behind = (Point(point.theta + sign * size * np.eye(3)[k], point.nodes) for sign in (1, -1))
        slope = (program.objective(ahead) - program.objective(behind)) / (2 * size)
        assert system.theta_gradient[k] == pytest.approx(slope, rel=1e-4)
    if kind != "predictions":
        step = np.zeros_like(point.nodes[0])
        step[1, 1] = 1e-6
        ahead, behind = (Point(point.theta, (point.nodes[0] + sign * step,)) for sign in (1, -1))
        slope = (program.objective(ahead) - program.objective(behind)) / 2e-6
        assert system.blocks[0].node_gradient[1, 1] == pytest.approx(slope, rel=1e-4)


def test_the_mean_error_is_in_noise_floors(model: Model) -> None:
    """It is the mean absolute error of all samples that there are."""
    program = predictions(model, model.train, 0.0)
    point = suggested_point(program, model.space.guess)
    errors = [program.residuals(k, program.simulate(k, point).y) for k in range(2)]
    assert mean_error(program, point) == pytest.approx(np.mean(np.abs(np.concatenate(errors))))

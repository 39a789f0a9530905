"""Other tools get the same machine as this package, and what is missing, failed or slow is said, not hidden."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import peer_cases
import peers
import pytest
from peer_tools.shooting import output_function, step_function

SAMPLES = 300
DRIFT = {"polyline": 0.005, "lugre": 0.005}
"""Angle, rad, by which torque noise moves the motor from rest in 0.3 s, at most."""


@pytest.mark.parametrize("law", DRIFT)
def test_equations_for_peers_are_those_of_the_machine(law: str) -> None:
    """At the true parameters the discretised equations follow the plant, which knows nothing of them."""
    case = peer_cases.axis(law, SAMPLES, law)
    assert case.reference is not None
    run, p = case.runs[0], case.reference / case.scale
    step, seen = step_function(case), output_function(case)
    state, errors = np.zeros(case.state_scale.size), list[np.ndarray]()
    for k in range(SAMPLES):
        errors.append(np.asarray(seen(state, run.inputs[k], p)).ravel() * case.noise - run.measured[k])
        state = np.asarray(step(state, run.inputs[k], run.time[k + 1] - run.time[k], p)).ravel()
    motor = np.array(errors)[:, 0]
    assert np.ptp(run.measured[:, 0]) > 1000.0 * DRIFT[law]
    assert np.max(np.abs(motor)) < DRIFT[law]


def test_thinned_case_keeps_the_mean_input() -> None:
    """Every tenth sample is kept, and the torque between two of them is the mean of what was there."""
    case = peer_cases.axis("polyline", SAMPLES, "polyline")
    thin = case.thinned(10)
    assert thin.runs[0].time == pytest.approx(case.runs[0].time[::10])
    assert thin.runs[0].inputs[3] == pytest.approx(case.runs[0].inputs[30:40].mean(axis=0))


def measured(tool: str, merit: float, seconds: float = 1.0) -> peers.Measured:
    """Return a tool that ended at an objective."""
    return peers.Measured("polyline", tool, "", seconds, 0.5, True, {}, merit)


def test_same_optimum_is_within_a_percent_of_the_best() -> None:
    """The best may be anyone's; who found nothing reached nothing."""
    found = [measured(peers.OURS, 100.5), measured("cma", 100.0), measured("pyomo", 102.0), measured("rockit", np.nan)]
    assert [peers.same_optimum(item, found) for item in found] == [True, True, False, False]
    assert peers.row(found[1], found)[3] == "1.0"


def test_missing_tool_is_said_with_the_line_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tool whose package is not there is no failure of the benchmark."""
    monkeypatch.setitem(peers.CASES, "small", lambda: peer_cases.axis("polyline", SAMPLES, "small"))
    monkeypatch.setitem(peers.TOOLS, "none", peers.Tool("none", "not_there:solve", ("small",)))
    found = peers.measure("small", "none")
    assert peers.INSTALL in found.note and np.isnan(found.seconds)


def test_what_was_measured_is_taken_from_disk(tmp_path: Path) -> None:
    """A run goes on from what an earlier one left; nothing is measured twice."""
    for key in (peers.OURS, "pyomo"):
        peers.store(tmp_path / f"polyline-{key}.json", measured(key, 1.0, 42.0))
    found = peers.measure_case("polyline", ["pyomo"], tmp_path)
    assert [item.tool for item in found] == [peers.OURS, "pyomo"]
    assert [item.seconds for item in found] == [42.0, 42.0]


def test_tool_over_its_time_is_reported(tmp_path: Path) -> None:
    """The process is ended at the limit and the table says so."""
    found = peers.measured_apart("polyline", "casadi-exact", tmp_path, 0.01, again=False)
    assert found.note == "not within 0 s" and np.isnan(found.seconds)

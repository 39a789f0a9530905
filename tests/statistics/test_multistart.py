"""Multi-start: the ends of starts, which of them agree, and one that fails."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axes import TRUTH
from runs import HERE, right_problem

from friction_ocp.errors import FrictionOcpError
from friction_ocp.statistics import multistart as module
from friction_ocp.statistics.multistart import multistart
from friction_ocp.statistics.workshop import Workshop


def test_starts_of_an_easy_problem_agree() -> None:
    """All reach the truth, and count as one optimum."""
    found = multistart(right_problem(), 4, HERE)
    assert found.clusters == ((0, 1, 2, 3),)
    assert found.warnings == ()
    assert found.estimate.solver.starts == 4
    for item in found.estimate.parameters:
        assert abs(item.value - TRUTH[item.name]) < 4.0 * item.std_error
    assert found.ends[0].start == pytest.approx([item.guess for item in found.estimate.parameters])


FIT_START = module.fit_start


def bent(workshop: Workshop, start: list[float]) -> Any:
    """Fail where the Coulomb friction starts high, and end elsewhere where it starts low."""
    guess = workshop.model.space.guess
    if start[1] > 1.5 * guess[1]:
        raise RuntimeError("no luck")
    document = FIT_START(workshop, guess.tolist())
    if start[1] < 0.7 * guess[1]:
        document["objective"] *= 1.5
        document["point"]["theta"][2] *= 3.0
    return document


def test_ends_are_told_apart_and_a_failure_stops_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    """A start that raises is reported; another optimum is another cluster, ranked by its objective."""
    monkeypatch.setattr(module, "fit_start", bent)
    found = multistart(right_problem(seed=1), 9, HERE)
    starts = np.array([end.start[1] for end in found.ends]) / found.ends[0].start[1]
    expected = [None if ratio > 1.5 else 1 if ratio < 0.7 else 0 for ratio in starts]
    assert [end.cluster for end in found.ends] == expected
    assert {None, 0, 1} <= set(expected)
    assert {end.error for end in found.ends if end.cluster is None} == {"RuntimeError: no luck"}
    assert found.estimate.converged
    failed = expected.count(None)
    assert found.warnings == (f"{failed} of 9 starts failed, the first with: RuntimeError: no luck.",)


def test_ends_as_good_as_the_best_elsewhere_are_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """A valley along which the objective hardly changes is not passed over."""

    def along(workshop: Workshop, start: list[float]) -> Any:
        document = FIT_START(workshop, workshop.model.space.guess.tolist())
        document["objective"] *= 1.0001
        document["point"]["theta"][2] *= 1.5 if start[1] > workshop.model.space.guess[1] else 1.0
        return document

    monkeypatch.setattr(module, "fit_start", along)
    found = multistart(right_problem(), 3, HERE)
    assert len(found.clusters) == 2
    assert "1 of 3 starts end within 0.1 % of the best objective at other parameters" in found.warnings[0]


def test_no_end_at_all_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """It says what the first start died of."""

    def failing(workshop: Workshop, start: list[float]) -> Any:
        raise RuntimeError("no luck")

    monkeypatch.setattr(module, "fit_start", failing)
    with pytest.raises(FrictionOcpError, match="every start failed, the first with: RuntimeError: no luck"):
        multistart(right_problem(), 2, HERE)


def test_titles_and_paths_do_not_make_another_problem(tmp_path: Path) -> None:
    """What decides a number is fingerprinted, and what does not is not."""
    problem = right_problem()
    print_of = Workshop(problem).fingerprint
    assert Workshop(replace(problem, title="x", question="y", path=tmp_path)).fingerprint == print_of
    assert Workshop(right_problem(seed=1)).fingerprint != print_of
    assert Workshop(replace(problem, train=problem.train[:1])).fingerprint != print_of
    channel = problem.train[0].recording.channels["position"]
    values = channel.values.copy()
    values[7] += 1e-12
    recording = replace(
        problem.train[0].recording,
        channels={**problem.train[0].recording.channels, "position": replace(channel, values=values)},
    )
    touched = replace(problem, train=(replace(problem.train[0], recording=recording), problem.train[1]))
    assert Workshop(touched).fingerprint != print_of

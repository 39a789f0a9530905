"""How long a search may take is told before it begins, where it is long; no part of it goes on without end."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis import allowance, base_fit
from friction_ocp.diagnosis.bench import Bench, open_bench
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.options import considered
from friction_ocp.diagnosis.search import Search
from friction_ocp.estimation.model import prepare
from friction_ocp.execution.effort import piece, spent
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.statistics.execution import Execution

HERE = Execution(InProcess())


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Return the base model of a short log, fitted."""
    return open_bench(load_problem(write_case(tmp_path_factory.mktemp("axis"), axis())), HERE)


@pytest.mark.parametrize(("long", "patience", "told"), [(1e6, 1.0, 0), (0.0, 1.0, 1), (0.0, 1e-9, 1)])
def test_a_long_search_is_announced(
    bench: Bench, long: float, patience: float, told: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With what makes it shorter; a short one is not."""
    lines = list[str]()
    monkeypatch.setattr(allowance, "LONG", long)
    search = Search(bench, HERE, considered(bench.problem), 0.01, lambda what, share: lines.append(what), patience)
    assert len(lines) == told and all("may take about" in line and "`effort`" in line for line in lines)
    assert search.allowance.taken == 0.0


@pytest.mark.parametrize(("share", "early"), [(0.0, True), (0.2, False)])
def test_ways_around_the_kinks_of_a_base_model_end(
    share: float, early: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A drive that chatters has kinks without end: what is tried there takes a share of a usual search at most."""
    asked = list[bool]()

    def freed(fitted: FittedModel) -> FittedModel:
        with piece():
            asked.append(spent())
        return fitted

    monkeypatch.setattr(allowance, "OF_BASE", share)
    monkeypatch.setattr(base_fit, "freed", freed)
    base_fit.fit_base(prepare(load_problem(write_case(tmp_path, axis()))))
    assert asked == [early]

"""How long a search may take is told before it begins, where it is long."""

from __future__ import annotations

import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis import allowance
from friction_ocp.diagnosis.bench import Bench, open_bench
from friction_ocp.diagnosis.options import considered
from friction_ocp.diagnosis.search import Search
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
    assert search.effort == 0.0

"""Motions that separate rivals, worked on where the rivals have to be set up first."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.bench import open_bench
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.refit import completed, quick_refit
from friction_ocp.diagnosis.screen import screen
from friction_ocp.effects.registry import effects
from friction_ocp.excitation.contest import Contest, contested
from friction_ocp.excitation.limits import limits_of
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.statistics.execution import Execution


@pytest.mark.slow
def test_rivals_that_were_set_up_elsewhere_say_the_same(tmp_path: Path) -> None:
    """What goes to another process makes the same runs, and the same evidence of them."""
    problem = load_problem(write_case(tmp_path, axis(law="stribeck", tau_s=0.15, omega_s=6.0)))
    base = open_bench(problem, Execution(InProcess())).base
    rivals = list[FittedModel]()
    for name in ("stribeck", "quadratic_drag"):
        seen = screen(base, effects()[name], "motor", clues_of(base))
        assert seen is not None
        rivals.append(completed(quick_refit(base, seen)))
    here = Contest.between(base, rivals, limits_of(problem, clues_of(base)))
    there: Contest = pickle.loads(pickle.dumps(here))
    assert "rivals" not in there.__dict__
    found, expected = (contested(contest, InProcess()) for contest in (there, here))
    assert [run.motion.name for run, _ in found] == [run.motion.name for run, _ in expected]
    for (run, told), (other, known) in zip(found, expected, strict=True):
        assert told.separation == pytest.approx(known.separation, rel=1e-9)
        assert run.amplitude == other.amplitude
        for name, channel in other.recording.channels.items():
            assert run.recording.channels[name].values == pytest.approx(channel.values, rel=1e-9, abs=1e-12)

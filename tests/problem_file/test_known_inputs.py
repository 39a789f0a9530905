"""Outputs are compared while it is known what moves the machine: nothing is made up before and after the inputs."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
import pytest
from problem_workshop import Workshop

from friction_ocp.drive.stepping import stepped
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.experiment import Experiment, experiment
from friction_ocp.problem_file.check import check_before_fit
from friction_ocp.problem_file.load import load_problem

STEP = 2e-3
NEXT_ONE = 1.5 * STEP
"""A sample holds for the interval to the next one, which may come late."""


def laid(workshop: Workshop, **channels: Any) -> Experiment:
    """Return the recording of the workshop as an estimator takes it."""
    problem = load_problem(workshop.problem(lambda content: content["channels"].update(channels)))
    return experiment(problem.train[0], stepped(problem.drive), problem.drive.inputs, STEP)


def blank(file: h5py.File, begin: float, end: float) -> None:
    time, current = file["time"][:], file["channels/current"]
    current[:] = np.where((time < begin) | (time > end), np.nan, current[:])


def own_clock(file: h5py.File, name: str, time: Any, values: Any) -> None:
    unit = file[f"channels/{name}"].attrs["unit"] if name in file["channels"] else "degC"
    file.pop(f"channels/{name}", None)
    file[f"clocks/of_{name}"], file[f"channels/{name}"] = time, values
    file[f"clocks/of_{name}"].attrs["unit"], file[f"channels/{name}"].attrs["unit"] = "s", unit
    file[f"channels/{name}"].attrs["clock"] = f"/clocks/of_{name}"


@pytest.mark.parametrize("begin, end", [(1.5, 6.0), (0.0, 4.5), (1.5, 4.5)])
@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_nothing_is_compared_where_the_current_is_not_known(
    workshop: Workshop, begin: float, end: float, hold: str
) -> None:
    """The run begins and ends with the current; the check says at which ends it lacks, and how to leave them out."""
    workshop.recording("sweep.h5", lambda file: blank(file, begin, end))
    current = {"measures": "motor.current", "role": "input", "hold": hold}
    item = laid(workshop, current=current)
    assert item.grid.time[0] == pytest.approx(begin, abs=NEXT_ONE)
    assert item.grid.time[-1] == pytest.approx(min(end, 6.0 - STEP), abs=NEXT_ONE)
    said = [str(finding) for finding in check_before_fit(load_problem(workshop.folder / "problem.yaml"))]
    early, late = (
        any(f"{word}: {at}` beside the file" in line for line in said)
        for word, at in (("state `from", "1.5"), ("state `to", "4.5"))
    )
    assert (early, late) == (begin > 0.0, end < 6.0)


def test_a_stated_delay_moves_what_is_known(workshop: Workshop) -> None:
    """A current that is shown 0.1 s late is not known in the last 0.1 s, and nothing is said of that."""
    item = laid(workshop, current={"measures": "motor.current", "role": "input", "delay": 0.1})
    assert item.grid.time[-1] == pytest.approx(5.898, abs=NEXT_ONE)
    assert not any(
        "no samples" in str(finding) for finding in check_before_fit(load_problem(workshop.folder / "problem.yaml"))
    )


def test_slow_inputs_and_commands_that_come_when_they_change_are_held(workshop: Workshop) -> None:
    """A temperature once a second, and a command that last changed 2 s before the end, leave nothing out."""

    def spoil(file: h5py.File) -> None:
        own_clock(file, "heat", np.arange(0.5, 5.0), np.arange(20.0, 25.0))
        changes = np.array([0.0, 0.5, 0.6, 0.9, 1.8, 2.0, 3.9, 4.0])
        own_clock(file, "current", changes, 0.3 * np.array([1, -1, 1, -1, 1, -1, 1, -1]))

    workshop.recording("sweep.h5", spoil)
    heat = {"measures": "temperature", "role": "input"}
    current = {"measures": "motor.current", "role": "input", "hold": "zero"}
    item = laid(workshop, heat=heat, current=current)
    assert (item.grid.time[0], item.grid.time[-1]) == (0.0, pytest.approx(6.0 - STEP))


def test_a_current_of_another_day_is_refused(workshop: Workshop) -> None:
    """Stamps that share no time with the outputs leave nothing to compare."""
    workshop.recording(
        "sweep.h5", lambda file: own_clock(file, "current", file["time"][:] + 1e5, file["channels/current"][:])
    )
    with pytest.raises(FrictionOcpError, match="nothing is measured while it is known what moves the machine"):
        laid(workshop)

"""Pieces of one log: to train on the one and judge by the other, or to leave out what is no motion of the drive."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from problem_workshop import Workshop

from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.stepping import stepped
from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.experiment import experiment
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.problem_file.dump import dump_problem
from friction_ocp.problem_file.load import load_problem

STEP = 2e-3


def split(workshop: Workshop, train: list[Any], validation: list[Any] | None = None, **position: Any) -> Path:
    """Write the problem with pieces of its recording, or of others."""

    def spoil(content: dict[str, Any]) -> None:
        content["recordings"] = {"train": train, "validation": validation or []}
        content["channels"]["position"] |= position
        if "clock" in position:
            content["clocks"] = {"logger": {"offset": 100.0, "drift": 0.01}}

    return workshop.problem(spoil)


def piece(begin: float | None = None, end: float | None = None, **more: Any) -> dict[str, Any]:
    ends = {key: value for key, value in (("from", begin), ("to", end)) if value is not None}
    return {"file": "sweep.h5", **ends, **more}


def times(use: RecordingUse, channel: str) -> Any:
    return use.recording.channels[channel].time


def test_one_log_trains_and_judges(workshop: Workshop) -> None:
    """Pieces that meet share no sample and lose none."""
    path = split(workshop, [piece(end=4.0)], [piece(4.0)])
    problem = load_problem(path)
    first, second = problem.train[0], problem.validation[0]
    assert (first.name, second.name) == ("sweep_to_4", "sweep_from_4")
    assert second.file == "sweep_from_4.h5"
    joined = np.concatenate([times(first, "position"), times(second, "position")])
    assert np.array_equal(joined, times(load_problem(split(workshop, ["sweep.h5"])).train[0], "position"))
    assert not workshop.messages(split(workshop, [piece(end=4.0)], [piece(4.0)]))


def test_an_input_with_stamps_of_its_own_is_known_up_to_either_end(workshop: Workshop) -> None:
    """Where it is logged once a second, the sample before the piece begins still holds in it."""

    def slow(file: Any) -> None:
        for name, values in (("clocks/slow", np.arange(0.0, 7.0)), ("channels/supply", np.arange(12.0, 19.0))):
            file[name] = values
        file["clocks/slow"].attrs["unit"], file["channels/supply"].attrs["unit"] = "s", "1"
        file["channels/supply"].attrs["clock"] = "/clocks/slow"

    workshop.recording("sweep.h5", slow)
    use = load_problem(split(workshop, [piece(2.5, 4.5)])).train[0]
    assert list(times(use, "supply")) == [2.0, 3.0, 4.0, 5.0]
    assert times(use, "current") == pytest.approx(times(use, "position"))


def test_a_piece_begins_with_a_tick_of_the_controller(workshop: Workshop) -> None:
    """Its loop of 6 ms computed at 2.502 s, three samples apart, and not where the piece was cut."""

    def spoil(content: dict[str, Any]) -> None:
        content["drive"]["motor"] = {"torque_constant": 0.5}
        content["channels"]["current"] = {"measures": "reference.theta", "role": "input"}
        loop = {"type": "p", "feedback": "position", "kp": 1.0, "sample_time": 6e-3, "output": "torque"}
        content |= {"controller": loop, "recordings": {"train": [piece(2.5)]}}

    workshop.recording("sweep.h5", lambda file: file["channels/current"].attrs.__setitem__("unit", "rad"))
    use = load_problem(workshop.problem(spoil)).train[0]
    assert times(use, "position")[0] == pytest.approx(2.502)


def test_what_is_no_motion_of_the_drive_is_left_out(workshop: Workshop) -> None:
    """A push by hand in the middle of a log spoils the fit, unless the pieces before and after it are used."""

    def pushed(file: Any) -> None:
        time = file["time"][:]
        file["channels/position"][:] += 2.0 * np.clip((time - 2.0) / 0.2, 0.0, 1.0)

    workshop.recording("pushed.h5", pushed)
    clean = identify(load_problem(split(workshop, ["sweep.h5"])))
    around = [{"file": "pushed.h5", "to": 2.0}, {"file": "pushed.h5", "from": 2.4}]
    apart = identify(load_problem(split(workshop, list(around))))
    whole = identify(load_problem(split(workshop, ["pushed.h5"])))
    truth = clean.values["load.inertia"]
    assert apart.values["load.inertia"] == pytest.approx(truth, rel=2e-3)
    assert abs(whole.values["load.inertia"] - truth) > 2e-2 * truth


@pytest.mark.parametrize(
    ("train", "began"), [([piece(1.0, 2.0), piece(3.0, 4.0)], 1.0), (["sweep.h5", piece(3.0)], 0.0)]
)
def test_time_counts_alike_in_all_pieces(workshop: Workshop, train: list[Any], began: float) -> None:
    """A machine that warms up, or that something shakes, goes on in the second piece where the first left off."""

    def spoil(content: dict[str, Any]) -> None:
        content["drive"]["shafts"][0]["disturbance"] = {"cosine": 0.01, "sine": 0.0, "period": 0.7}
        content["recordings"] = {"train": train}

    problem = load_problem(workshop.problem(spoil))
    drive = stepped(problem.drive)
    at = drive.input_names.index(TIME)
    for use in problem.train:
        grid = experiment(use, drive, problem.drive.inputs, STEP).grid
        assert grid.at_node[:, at] == pytest.approx(grid.time - began, abs=1e-12)
        assert grid.time[0] == pytest.approx(times(use, "position")[0])


def test_a_channel_of_another_clock_is_cut_at_the_same_moment(workshop: Workshop) -> None:
    """Its stamps are 100 s and 1 % later: what it shows from 104.04 s on happened from 4 s on."""

    def foreign(file: Any) -> None:
        file["clocks/logger"] = 100.0 + 1.01 * file["time"][:]
        file["clocks/logger"].attrs["unit"] = "s"
        file["channels/position"].attrs["clock"] = "/clocks/logger"

    workshop.recording("sweep.h5", foreign)
    use = load_problem(split(workshop, [piece(4.0)], clock="logger")).train[0]
    assert times(use, "position")[0] == pytest.approx(100.0 + 1.01 * 4.0, abs=1.01 * STEP)
    assert times(use, "current")[0] == pytest.approx(4.0, abs=STEP)


def test_the_fitted_problem_keeps_its_pieces(workshop: Workshop) -> None:
    """Ends and numbers of a piece stand in the file with the answer; its own values are found by its name."""
    free = {"guess": 0.1, "scope": "recording"}
    ends = [piece(end=2.0), piece(2.0, 4.5, set={"motor.torque_constant": 0.4})]
    source = split(workshop, ends, offset=free)
    fitted = {"position.offset@sweep_to_2": 0.2, "position.offset@sweep_from_2_to_4.5": 0.3}
    target = workshop.folder / "fitted.yaml"
    target.write_text(dump_problem(source, fitted, workshop.folder), encoding="utf-8")
    before, after = load_problem(source), load_problem(target)
    assert [use.name for use in after.train] == [use.name for use in before.train]
    assert np.array_equal(times(after.train[1], "position"), times(before.train[1], "position"))
    assert [dict(use.set) for use in after.train] == [
        {"position.offset": 0.2},
        {"motor.torque_constant": 0.4, "position.offset": 0.3},
    ]


def point_file(folder: Path) -> None:
    with h5py.File(folder / "points.h5", "w") as file:
        file.attrs["format"] = "friction-ocp-static/1"
        for name, unit in (("speed", "rad/s"), ("torque", "N m")):
            file[name] = np.linspace(1.0, 2.0, 5)
            file[name].attrs["unit"] = unit


BAD = {
    "the wrong way round": (
        [piece(4.0, 1.0)],
        r"recordings.train\[0\].to: the piece ends at 1 s and begins at 4 s; a time after `from`",
    ),
    "where nothing was recorded": (
        [piece(60.0)],
        r"recordings.train\[0\]: .*sweep.h5: nothing of it was recorded .* it lasts from 0 s to 5.998 s",
    ),
    "no number": ([piece() | {"from": "noon"}], r"recordings.train\[0\].from: this is 'noon'; a number"),
    "not finite": ([piece() | {"to": float("nan")}], r"recordings.train\[0\].to: this is nan; a finite number"),
    "of static points": (
        ["sweep.h5", {"file": "points.h5", "from": 1.0}],
        r"recordings.train\[1\]: .*points.h5: static points have no time",
    ),
    "twice": (
        [piece(end=4.0), piece(3.0)],
        r"recordings.train\[1\]: .*sweep.h5: 0.998 s of this piece also stand in recordings.train\[0\]",
    ),
    "almost nothing": ([piece(1.0, 1.004)], r"no output has more than 2 samples"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_piece_that_makes_no_sense_is_told(workshop: Workshop, case: str) -> None:
    """Where, what, what is allowed, and what to do."""
    point_file(workshop.folder)
    train, expected = BAD[case]
    messages = workshop.messages(split(workshop, train))
    assert len([message for message in messages if re.search(expected, message)]) == 1

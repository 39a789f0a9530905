"""The problem with its answer: fitted values as guesses, everything else as it was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from problem_workshop import Workshop

from friction_ocp.drive.values import drive_leaves
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.problem import Problem
from friction_ocp.parameters import Free
from friction_ocp.problem_file.document import dump_document, read_document
from friction_ocp.problem_file.dump import dump_problem
from friction_ocp.problem_file.load import load_problem

HEAD = "Asked: a question.\n\n  Known: an indented line."

PARTS = ("share", "soft", "stiff")


def values_of(problem: Problem) -> dict[str, Any]:
    return {leaf.path: leaf.value for leaf in drive_leaves(problem.drive)}


def reread(source: Path, values: dict[str, float], folder: Path) -> Problem:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "fitted.yaml"
    path.write_text(dump_problem(source, values, folder), encoding="utf-8")
    return load_problem(path)


def test_guesses_become_the_fitted_values(workshop: Workshop) -> None:
    """Each guess is its fitted value to the last bit; bounds, fixed numbers, recordings and the head stay."""
    source = workshop.problem(head=HEAD)
    before = load_problem(source)
    fitted = {"load.inertia": 0.1 + 0.2, "load.friction.tau_c": 1e-7}
    after = reread(source, fitted, workshop.folder / "results" / "run")
    for path, value in values_of(before).items():
        expected = replace(value, guess=fitted[path]) if path in fitted else value
        assert values_of(after)[path] == expected
    assert after.question == before.question == HEAD
    assert after.estimation == before.estimation
    assert after.train[0].recording.sha256 == before.train[0].recording.sha256


def test_prior_stays_where_it_was(workshop: Workshop) -> None:
    """A prior around the guess keeps its mean when the guess moves; a stated mean is left alone."""

    def spoil(content: dict[str, Any]) -> None:
        shaft = content["drive"]["shafts"][0]
        shaft["inertia"] = {"guess": 0.02, "prior_std": 0.01}
        shaft["friction"]["tau_c"] = {"guess": 0.05, "prior_std": 0.01, "prior_mean": 0.04}

    after = values_of(
        reread(workshop.problem(spoil), {"load.inertia": 1, "load.friction.tau_c": 0.055}, workshop.folder)
    )
    assert after["load.inertia"] == Free(1.0, prior_std=0.01, prior_mean=0.02)
    assert after["load.friction.tau_c"] == Free(0.055, prior_std=0.01, prior_mean=0.04)


def test_every_fitted_number_is_found(workshop: Workshop) -> None:
    """Numbers of motors, transmissions, channels, lists and directions are all replaced."""

    def spoil(content: dict[str, Any]) -> None:
        one = {"guess": 1.0}
        content["drive"] = {
            "motors": [{"name": "motor", "shaft": "load", "torque_constant": one}],
            "shafts": [
                {
                    "name": "load",
                    "inertia": one,
                    "friction": {
                        "law": "polyline",
                        "tau_c": {"positive": one, "negative": one},
                        "slopes": {"positive": [one, one], "negative": [one, one]},
                        "breaks": [one],
                        "bristle": {"sigma0": one, "springs": dict.fromkeys((*PARTS, "stiffness"), one)},
                    },
                },
                {"name": "arm", "inertia": one, "gravity": {"torque": one}},
                {
                    "name": "table",
                    "inertia": one,
                    "friction": {
                        "law": "gms",
                        "elements": [{"stiffness": one, "share": {"positive": one, "negative": one}}],
                        "tau_c": one,
                        "tau_s": 9.0,
                        "omega_s": 1.0,
                    },
                },
            ],
            "transmissions": [
                {
                    "stiffness": one,
                    "damping": one,
                    "hysteresis": {"torque": one, "twist": one, "springs": dict.fromkeys((*PARTS, "twist"), one)},
                },
                {"stiffness": "rigid"},
            ],
        }
        content["channels"]["position"] |= {"gain": one, "offset": one, "delay": one}

    source = workshop.problem(spoil)
    free = [path for path, value in values_of(load_problem(source)).items() if isinstance(value, Free)]
    fitted = {path: 1.0 + 0.01 * k for k, path in enumerate(free)}
    after = values_of(reread(source, fitted, workshop.folder))
    assert len(free) == 32
    assert {path: after[path].guess for path in free} == fitted


def test_values_of_one_recording_stand_beside_it(workshop: Workshop) -> None:
    """`path@recording` becomes a `set` beside that recording, and the guess is left alone."""
    workshop.recording("second.h5")

    def spoil(content: dict[str, Any]) -> None:
        content["channels"]["position"]["offset"] = {"guess": 0.1, "scope": "recording"}
        content["recordings"]["train"] = ["sweep.h5", {"file": "second.h5", "set": {"motor.torque_constant": 0.4}}]

    fitted = {"position.offset@sweep": 0.2, "position.offset@second": 0.3}
    after = reread(workshop.problem(spoil), fitted, workshop.folder / "out")
    assert after.train[0].set == {"position.offset": 0.2}
    assert after.train[1].set == {"motor.torque_constant": 0.4, "position.offset": 0.3}
    assert values_of(after)["position.offset"].guess == 0.1


def test_value_beyond_a_bound_by_rounding_is_put_on_it(workshop: Workshop) -> None:
    """A solver that ends a rounding error beyond a bound does not make a file that cannot be read."""
    after = values_of(reread(workshop.problem(), {"load.friction.viscous": -1e-15}, workshop.folder))
    assert after["load.friction.viscous"].guess == 0.0


def test_value_that_is_not_fitted_is_refused(workshop: Workshop) -> None:
    """A name that the file does not fit is refused with the closest one."""
    with pytest.raises(FrictionOcpError, match=r"'load.inertai' is not fitted; did you mean 'load.inertia'"):
        dump_problem(workshop.problem(), {"load.inertai": 1.0}, workshop.folder)


def test_shared_anchor_is_written_out(workshop: Workshop) -> None:
    """Two numbers that share an anchor get their own values."""
    source = workshop.problem()
    text = source.read_text().replace("tau_c: {guess: 0.05, min: 0, max: 1}", "tau_c: &f {guess: 0.05, min: 0, max: 1}")
    source.write_text(text.replace("tau_s: {guess: 0.06, min: 0, max: 1}", "tau_s: *f"))
    after = values_of(reread(source, {"load.friction.tau_c": 0.1, "load.friction.tau_s": 0.2}, workshop.folder / "out"))
    assert (after["load.friction.tau_c"].guess, after["load.friction.tau_s"].guess) == (0.1, 0.2)


SCALARS = [
    "1e5",
    "yes",
    "010",
    "12:30",
    "1_000",
    "2024-01-01",
    "null",
    "",
    "a: b",
    "# c",
    1,
    1e-7,
    1e300,
    0.1,
    True,
    None,
]


def test_document_survives_its_own_text(tmp_path: Path) -> None:
    """Texts stay texts and numbers stay numbers when a document is written and read."""
    path = tmp_path / "document.yaml"
    content = {"values": SCALARS, "nested": {"1e5": {"on": [1, {"x": 2}]}}}
    path.write_text(dump_document(content, HEAD), encoding="utf-8")
    document = read_document(path)
    assert (document.content, document.head) == (content, HEAD)


def test_numbers_are_read_as_people_write_them(tmp_path: Path) -> None:
    """1e5 is a number; yes, 12:30 and 2024-01-01 are texts; 010 is ten."""
    path = tmp_path / "document.yaml"
    path.write_text("a: [1e5, 6.0e4, -2.5E-3, .5, 1., 010, .inf, yes, 12:30, 2024-01-01, true, null]\n")
    expected = [1e5, 6e4, -2.5e-3, 0.5, 1.0, 10, float("inf"), "yes", "12:30", "2024-01-01", True, None]
    assert read_document(path).content == {"a": expected}

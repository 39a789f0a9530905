"""Results beside one another: values, differences, and what else is not the same."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from friction_ocp.cli import DONE, WRONG_INPUT, main

sys.path.insert(0, str(Path(__file__).parent / "fleet"))

from simulated_fleet import Change, write_axis, write_fleet

GROWTH = 0.2


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with identifications of two nights, between which friction grew, and a batch of both."""
    folder = tmp_path_factory.mktemp("results")
    files = write_fleet(folder / "nights", 1, 2, (Change(0, GROWTH),))
    for number, file in enumerate(files, 1):
        problem = write_axis(folder / f"night{number}.yaml", file)
        assert main(["identify", str(problem), "--out", str(folder / f"night-{number}")]) == DONE
    batch = ["batch", str(folder / "night1.yaml"), str(folder / "nights"), "--workers", "1"]
    assert main([*batch, "--out", str(folder / "fleet")]) == DONE
    return folder


def compared(folder: Path, *paths: Path) -> dict[str, Any]:
    """Compare results and return the document."""
    assert main(["compare", *map(str, paths), "--out", str(folder / "out")]) == DONE
    assert (folder / "out" / "figures" / "parameters.svg").exists()
    return json.loads((folder / "out" / "result.json").read_text(encoding="utf-8"))


def test_a_change_between_two_nights_stands_out(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Values as in the results, their difference in per cent and in standard deviations of both."""
    document = compared(tmp_path, made / "night-1", made / "night-2" / "result.json")
    before, after = (
        json.loads((made / f"night-{k}" / "result.json").read_text(encoding="utf-8"))["parameters"] for k in (1, 2)
    )
    assert document["parameters"].keys() == before.keys()
    name = "motor.friction.tau_c"
    first, second = document["parameters"][name]["values"]
    assert (first["value"], second["value"]) == (before[name]["value"], after[name]["value"])
    (difference,) = document["parameters"][name]["differences"]
    assert difference["relative"] == pytest.approx(second["value"] / first["value"] - 1.0)
    expected = (second["value"] - first["value"]) / (first["std_error"] ** 2 + second["std_error"] ** 2) ** 0.5
    assert difference["deviations"] == pytest.approx(expected) and abs(expected) > 10.0
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "standard deviations from the first result&#39;s" in page and "night-<wbr>1" in page
    printed = capsys.readouterr().out
    assert name in printed and "rms" not in document["parameters"]
    assert [item["channel"] for item in document["errors"]] == ["position"]


def test_results_of_the_same_recording_are_not_told_apart_by_chance(made: Path, tmp_path: Path) -> None:
    """Their noise is the same: no standard deviations, and a note that says so."""
    document = compared(tmp_path, made / "night-1", made / "night-1")
    assert all(item["differences"][0]["deviations"] is None for item in document["parameters"].values())
    assert all(item["differences"][0]["absolute"] == 0.0 for item in document["parameters"].values())
    assert any("share 1 recordings" in note for note in document["notes"])
    assert [item["name"] for item in document["results"]] == ["night-1", "night-1 (2)"]


def test_batches_are_compared_by_machine(made: Path, tmp_path: Path) -> None:
    """Each level of each machine is a row."""
    document = compared(tmp_path, made / "fleet", made / "fleet")
    assert "telescope-01: motor.inertia" in document["parameters"]


@pytest.mark.parametrize(
    ("names", "complaint"),
    [
        (["night-1"], "1 result given; two or more"),
        (["night-1", "night1.yaml"], "only results, or only problem files"),
    ],
)
def test_what_cannot_be_compared_is_wrong_input(
    names: list[str], complaint: str, made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Status 1, and what is allowed."""
    paths = [str(made / name) for name in names]
    assert main(["compare", *paths, "--out", str(tmp_path / "out")]) == WRONG_INPUT
    assert complaint in capsys.readouterr().err

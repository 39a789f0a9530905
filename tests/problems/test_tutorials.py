"""Tutorials run as they stand, leave their pictures, and come to what their text says."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import pytest
from PIL import Image
from servo_problem import REPOSITORY

from friction_ocp.effects import registry as effect_registry
from friction_ocp.friction import registry as law_registry

FOLDER = REPOSITORY / "problems" / "tutorials"
TUTORIALS = sorted(path.stem for path in FOLDER.glob("*.py"))
README = (REPOSITORY / "README.md").read_text(encoding="utf-8")


def run(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Run a tutorial in a folder that looks like the repository; return its names."""
    for part in ("problems", "data"):
        (folder / part).symlink_to(REPOSITORY / part)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(law_registry, "_registered", {})
    monkeypatch.setattr(effect_registry, "_registered", {})
    matplotlib.use("Agg")
    names = runpy.run_path(str(Path("problems") / "tutorials" / f"{name}.py"))
    plt.close("all")
    saved = re.findall(r'savefig\(OUT / "([\w.]+)"', (FOLDER / f"{name}.py").read_text(encoding="utf-8"))
    assert saved
    for picture in saved:
        with Image.open(folder / "results" / "tutorials" / name / picture) as image:
            assert min(image.size) > 200 and sum(count > 0 for count in image.convert("L").histogram()) > 20
    return names


@pytest.mark.parametrize("name", TUTORIALS)
def test_a_tutorial_reads_as_cells(name: str) -> None:
    """Percent format: a title, text between the code, the command that runs it, and a link in the README."""
    text = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
    assert text.startswith("# %% [markdown]\n# # ")
    assert text.count("# %% [markdown]") >= 5 and text.count("\n# %%\n") >= 3
    assert f".venv/bin/python problems/tutorials/{name}.py" in text
    assert f"(problems/tutorials/{name}.py)" in README


@pytest.mark.slow
def test_a_first_identification(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The answer is nearer to the machine than the guesses, and every parameter is told."""
    names = run("first_identification", tmp_path, monkeypatch)
    assert names["after"].mae < 0.7 * names["before"].mae
    assert {item.verdict.word for item in names["estimate"].parameters} == {"ok"}


@pytest.mark.slow
def test_from_log_to_mujoco(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is lost on the way, and the pendulum of MuJoCo comes to rest where the recorded one does."""
    names = run("from_log_to_mujoco", tmp_path, monkeypatch)
    assert names["exported"].losses == ()
    assert all(row.share < 0.02 for row in names["exported"].price())
    assert names["swing"][-1] == pytest.approx(names["angle"][-1], abs=0.05)
    assert names["swing"].max() == pytest.approx(names["angle"].max(), rel=0.2)


@pytest.mark.slow
def test_reading_a_diagnosis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Load dependence is what it finds, and the gap becomes smaller on recordings that chose nothing."""
    result = run("reading_a_diagnosis", tmp_path, monkeypatch)["result"]
    assert "load_dependence" in [item["effect"] for item in result["accepted"]]
    assert result["gap"]["shrink"]["interval95"][0] > 0.2


@pytest.mark.slow
def test_designing_the_next_experiment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The best motion keeps the limits and sharpens every parameter."""
    names = run("designing_the_next_experiment", tmp_path, monkeypatch)
    best, design = names["best"], names["design"]
    assert best.run.peaks["torque"] <= 1.05 * 0.9
    assert (best.std_errors < design.std_errors).all()
    assert best.worth > 2.0 * design.options[-1].worth


@pytest.mark.slow
def test_your_own_law_and_effect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The law is fitted from a file, the effect competes, and neither is what the servo lacks."""
    names = run("your_own_law_and_effect", tmp_path, monkeypatch)
    assert names["greased"].converged
    likely = {cause["effect"]: cause["probability"] for cause in names["result"]["rounds"][0]["causes"]}
    assert likely["grease"] < likely["load_dependence"]

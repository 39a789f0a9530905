"""The gallery shows every problem file, with its question and a picture where its recordings are there."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from lto_cases import REPOSITORY

sys.path.append(str(REPOSITORY / "problems"))

import gallery

from friction_ocp import load_problem
from friction_ocp.estimation.model import prepare


@pytest.fixture(scope="module")
def sections() -> dict[str, str]:
    """Sections of the page by their title."""
    return gallery.sections_of(gallery.PAGE.read_text(encoding="utf-8"))


def test_every_problem_file_is_listed_and_no_other(sections: dict[str, str]) -> None:
    """One section a file, in their order."""
    assert list(sections) == [f"{path.parent.name}/{path.stem}" for path in gallery.problem_files()]


def test_questions_are_those_of_the_files(sections: dict[str, str]) -> None:
    """The page was made from the files as they are."""
    for path in gallery.problem_files():
        assert gallery.question_of(path) in sections[f"{path.parent.name}/{path.stem}"]


def test_pictures_are_there_and_all_are_shown(sections: dict[str, str]) -> None:
    """Every picture that the page shows exists, every one in the folder is shown, and answers name every parameter."""
    shown = {name for text in sections.values() for name in re.findall(r"\(gallery/(.+?\.png)\)", text)}
    assert shown == {path.name for path in gallery.PICTURES.glob("*.png")}
    for path in gallery.problem_files():
        text = sections[f"{path.parent.name}/{path.stem}"]
        if "](gallery/" in text and gallery.identify_needed(path):
            named = re.findall(r"^\| `(.+?)` \|", text, re.MULTILINE)
            assert named == list(free_names(path)), path


def free_names(path: Path) -> list[str]:
    """Return the names of what a problem file asks for."""
    return list(prepare(load_problem(path)).space.names)

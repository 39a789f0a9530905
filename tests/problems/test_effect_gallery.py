"""The gallery of effects shows the whole catalogue, as its script makes it."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from lto_cases import REPOSITORY

sys.path.append(str(REPOSITORY / "problems"))

import effect_gallery

from friction_ocp.effects.registry import effects


def sections(folder: Path) -> dict[str, str]:
    return effect_gallery.sections_of((folder / "README.md").read_text(encoding="utf-8"))


def test_every_effect_has_a_section_with_its_picture() -> None:
    """In the order of the catalogue, each named by the diagnosis that the section tells of."""
    shown = sections(effect_gallery.FOLDER)
    assert list(shown) == list(effects())
    for name, text in shown.items():
        assert re.search(rf"\black(s|ed)?\b.*{name.replace('_', ' ')} at|most likely {name.replace('_', ' ')} at", text)
        assert (effect_gallery.FOLDER / f"{name}.png").stat().st_size > 5000


@pytest.mark.slow
def test_a_section_is_made_in_another_folder(tmp_path: Path) -> None:
    """With `--only` the one effect that is asked for."""
    effect_gallery.main(["--only", "presliding", "--out", str(tmp_path)])
    assert list(sections(tmp_path)) == ["presliding"]
    assert (tmp_path / "presliding.png").is_file()

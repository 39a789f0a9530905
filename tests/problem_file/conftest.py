"""The folder in which the tests of problem files work."""

from __future__ import annotations

from pathlib import Path

import pytest
from problem_workshop import Workshop


@pytest.fixture
def workshop(tmp_path: Path) -> Workshop:
    """A folder with a sound recording."""
    made = Workshop(tmp_path)
    made.recording()
    return made

"""Lets the tests of this folder import the plant and the small drives, which lie beside it."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "estimation")]

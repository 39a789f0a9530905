"""A blind suite: drives with a hidden effect, none, two, or one outside the catalogue, and the score of a diagnosis."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))  # the plant

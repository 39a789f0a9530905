"""Makes problems/blind importable as the package `blind`."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "problems"))

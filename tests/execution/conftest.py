"""Lets the tests of this folder import the small drives of their neighbours."""

from __future__ import annotations

import sys
from pathlib import Path

for folder in ("diagnosis", "estimation"):
    sys.path.insert(0, str(Path(__file__).parents[1] / folder))

"""Makes the scripts of problems/benchmarks importable."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "problems" / "benchmarks"))

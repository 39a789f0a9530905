"""The lines of formats, fleets and clusters, measured; `acceptance.py users` prints them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import fleet
from checks import Check


def batches(line: str, quick: bool) -> Check:
    """Simulate and fit 200 nights, or fewer."""
    return fleet.check(line, 4, 8) if quick else fleet.check(line)


MEASURES: Mapping[str, Callable[[str, bool], Check]] = {"batch": batches}
"""By ID in done_when.yaml."""

"""Speeds of shafts over one another, as the ratios of what joins them make them."""

from __future__ import annotations

from collections.abc import Mapping

from friction_ocp.drive.parts import Drive


def relative_speeds(drive: Drive, numbers: Mapping[str, float]) -> dict[str, float]:
    """Return the speed of every shaft that is joined to the first one over the speed of that, at given numbers."""
    found = {drive.shafts[0].name: 1.0}
    for _ in drive.transmissions:
        for item in drive.transmissions:
            ratio = float(numbers.get(f"{item.name}.ratio", 1.0))
            if item.from_shaft in found:
                found.setdefault(item.to_shaft, found[item.from_shaft] / ratio)
            elif item.to_shaft in found:
                found[item.from_shaft] = found[item.to_shaft] * ratio
    return found

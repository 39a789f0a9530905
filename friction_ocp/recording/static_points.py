"""Static points: steady friction torque or current over speed, one value per run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from friction_ocp.recording.recording import FloatArray


@dataclass(frozen=True)
class StaticPoints:
    """Steady states of one machine: `torque` or `current`, or both, at each speed."""

    name: str
    speed: FloatArray
    """(n,) rad/s, or m/s for a linear drive."""
    units: Mapping[str, str]
    """The SI unit of every column that is present."""
    torque: FloatArray | None = None
    """(n,) N m, or N for a linear drive."""
    current: FloatArray | None = None
    """(n,) A."""
    std_error: FloatArray | None = None
    """(n,) standard error of the torque, or of the current where there is no torque."""
    position: FloatArray | None = None
    """(n,) rad or m."""
    direction: FloatArray | None = None
    """(n,) +1 or -1."""
    runs: FloatArray | None = None
    """(n,) number of runs behind each point."""
    title: str = ""
    source: str = ""
    licence: str = ""
    path: Path | None = None
    sha256: str = ""
    attributes: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def columns(self) -> Mapping[str, FloatArray]:
        """The columns that are present, by name."""
        columns = {name: getattr(self, name) for name in COLUMNS}
        return {name: values for name, values in columns.items() if values is not None}


COLUMNS = ("speed", "torque", "current", "std_error", "position", "direction", "runs")

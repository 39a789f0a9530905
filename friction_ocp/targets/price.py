"""What an export costs: both simulators run the same recordings, and a table says how far they are apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from friction_ocp.simulation.grid import FloatArray
from friction_ocp.targets.fitted import Fitted, Run, rms


@dataclass(frozen=True)
class PriceRow:
    """One channel of one recording, errors as root mean squares in the unit of the channel."""

    recording: str
    channel: str
    unit: str
    error_here: float
    """Free run of this package against the measurement."""
    error_there: float
    """Free run of the target against the measurement."""
    gap: float
    """Free run of the target against that of this package."""

    @property
    def share(self) -> float:
        """The gap that the export adds, over the error of the free run."""
        return self.gap / self.error_here if self.error_here > 0 else float("inf")


def price_table(fitted: Fitted, simulate: Callable[[Run], FloatArray]) -> tuple[PriceRow, ...]:
    """Run the target over the recordings by which the drive is judged, and compare."""
    rows: list[PriceRow] = []
    for run in fitted.runs():
        there, here, measured = simulate(run), run.free.simulated, run.free.measured
        for column, (name, unit) in enumerate(fitted.simulation.units.items()):
            seen = measured[:, column] == measured[:, column]
            errors = (here - measured, there - measured, there - here)
            sizes = (rms(error[seen, column]) for error in errors)
            if seen.any():
                rows.append(PriceRow(run.item.name, name, unit, *sizes))
    return tuple(rows)


def price_text(rows: Sequence[PriceRow], target: str) -> str:
    """Return the table as text."""
    cells: list[tuple[str, ...]] = [
        ("recording", "channel", "", "error here", f"error in {target}", "gap added", "share")
    ]
    for row in rows:
        numbers = (f"{value:.4g}" for value in (row.error_here, row.error_there, row.gap))
        cells.append((row.recording, row.channel, row.unit, *numbers, f"{row.share:.2%}"))
    widths = [max(len(row[k]) for row in cells) for k in range(len(cells[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells]
    return "\n".join(lines)


def judged_by(fitted: Fitted) -> str:
    """Return which recordings the table is about."""
    return "validation recordings" if fitted.model.validation else "training recordings"

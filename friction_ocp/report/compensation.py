"""What cancelling the friction is predicted to buy, in words and rows."""

from __future__ import annotations

from dataclasses import dataclass

from friction_ocp.plots.numbers import NOTHING, is_number, significant, unit_text
from friction_ocp.plots.reading import Json, objects, part

LITTLE = 0.05
"""Share of the tracking error below which friction is not what keeps a drive off its reference."""


@dataclass(frozen=True)
class TrackingRow:
    """The tracking error in one recording."""

    recording: str
    unit_text: str
    measured: str
    before: str
    after: str
    change: str


@dataclass(frozen=True)
class CompensationSection:
    """The prediction as the page shows it."""

    shaft: str
    sentence: str
    rows: tuple[TrackingRow, ...]


def compensation_section(result: Json) -> CompensationSection | None:
    """Return the prediction of a result; None for one without."""
    found = part(result, "friction_compensation")
    recordings = objects(found, "tracking_rms")
    if not recordings:
        return None
    rows = tuple(_row(name, item) for name, item in recordings.items())
    return CompensationSection(str(found.get("shaft")), compensation_sentence(result), rows)


def compensation_sentence(result: Json) -> str:
    """Return the prediction in one sentence, "" where there is none."""
    recordings = objects(part(result, "friction_compensation"), "tracking_rms").values()
    gains = [item["gain"] for item in recordings if is_number(item.get("gain"))]
    if not gains:
        return ""
    low, high = min(gains), max(gains)
    if high < LITTLE:
        return (
            "Friction is not what keeps the drive off its reference: cancelling it is predicted to take "
            f"{'nothing' if high <= 0 else f'at most {_percent(high)} %'} off the tracking error."
        )
    if low < 0:
        return (
            f"Cancelling the friction is predicted to take up to {_percent(high)} % off the tracking error, but to "
            f"add {_percent(-low)} % in another recording."
        )
    span = _percent(high) if _percent(low) == _percent(high) else f"{_percent(low)} to {_percent(high)}"
    return f"Cancelling the friction is predicted to take {span} % off the tracking error."


def _row(name: str, item: Json) -> TrackingRow:
    gain = item["gain"] if is_number(item.get("gain")) else None
    change = NOTHING if gain is None else f"{_percent(abs(gain))} % {'less' if gain >= 0 else 'more'}"
    measured, before, after = (significant(item.get(key), 3) for key in ("measured", "before", "after"))
    return TrackingRow(name, unit_text(str(item.get("unit") or "")), measured, before, after, change)


def _percent(share: float) -> str:
    return significant(100.0 * share, 2 if share >= 0.01 else 1)

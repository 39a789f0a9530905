"""A fleet in words."""

from __future__ import annotations

from collections.abc import Sequence

from friction_ocp.plots.numbers import percent, significant, to_resolution, unit_text
from friction_ocp.plots.reading import Json, part, rows

_MOST = 8


def fleet_sentence(result: Json) -> str:
    """Say what changed in one sentence or two."""
    moving, out = flagged(result), rows(result, "outliers")
    rate = f"{100 * result['false_alarm_rate']:g} %"
    count = len(part(result, "machines"))
    machines = f"{count} machine{'s' * (count != 1)}"
    tail = f"In a fleet in which nothing changes, anything is flagged with a probability of {rate} at most."
    fits = len(rows(result, "fits"))
    if not moving and not out:
        return f"Nothing changed beyond scatter in {fits} fits of {machines}. {tail}"
    drifting = _counted(len({(item["machine"], item["parameter"]) for item in moving}), "parameter drifts", "drift")
    standing = _counted(len({item["recording"] for item in out}), "fit stands out", "stand out")
    return f"{fits} fits of {machines}: {drifting}, {standing}. {tail}"


def _counted(count: int, one: str, verb: str) -> str:
    noun = one.split()[0]
    return one.join(("1 ", "")) if count == 1 else f"{count or 'no'} {noun}s {verb}"


def flagged(result: Json) -> Sequence[Json]:
    """Return the drifts that are flagged."""
    return [item for item in rows(result, "drifts") if item["flagged"]]


def drift_sentence(item: Json) -> str:
    """Say how a parameter moved."""
    size = f"{to_resolution(item['before'], abs(item['change']) / 30)} {unit_text(str(item['unit']))}".rstrip()
    when = when_text(item)
    relative = item["relative"]
    ends = item["interval95"]
    by = significant(item["change"], 2) if relative is None else percent(relative, 2)
    between = ""
    if ends and relative is not None:
        low, high = sorted(end / abs(item["before"]) for end in ends)
        between = f" ({percent(low, 2)} to {percent(high, 2)})"
    way = "jumps" if item["shape"] == "step" else "moves steadily"
    return f"{item['machine']}: {item['parameter']} {way} by {by}{between} of {size} after {when}"


def when_text(item: Json) -> str:
    """Return the day after which a parameter moved, or the recording where no day is known."""
    return short_time(str(item["after_started"])) or str(item["after"])


def short_time(text: str) -> str:
    """Return an ISO 8601 time to the minute, as it is written on a wall."""
    return text.strip()[:16].replace("T", " ")


def outlier_sentence(item: Json) -> str:
    """Say how far a fit lies from the others."""
    unit = unit_text(str(item["unit"]))
    value, expected = significant(item["value"]), significant(item["expected"])
    what = f"{item['machine']}: {item['parameter']} = {value} {unit} in {item['recording']}"
    return f"{what}, where {expected} was expected ({significant(abs(item['distance']), 2)} deviations)"


def fleet_summary(result: Json) -> str:
    """Return a fleet in a few lines of plain text."""
    lines = [str(result["title"]), "", fleet_sentence(result), str(result["message"])]
    warnings = rows(result, "warnings")
    lines += [f"! {text}" for text in warnings[:_MOST]]
    lines += [f"! and {len(warnings) - _MOST} more"] if len(warnings) > _MOST else []
    lines += [f"drift: {drift_sentence(item)}" for item in flagged(result)]
    lines += [f"outlier: {outlier_sentence(item)}" for item in rows(result, "outliers")]
    return "\n".join(lines)

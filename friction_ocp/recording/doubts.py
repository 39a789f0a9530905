"""What is doubtful about the samples of a recording, whatever they are of: one rule a function."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.quantities import to_si
from friction_ocp.recording.counters import Turnover, turnover
from friction_ocp.recording.excursions import excursions
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import Column, ImportMap
from friction_ocp.recording.recording import Channel, Recording
from friction_ocp.recording.sampling import gaps, held_for, unseen_ends

ACROSS_GAPS = "inputs run in a line across it (hold: zero keeps the last value), and nothing is compared there"
"""What becomes of a gap."""
AT_ENDS = "where it is not known what moves the machine, nothing is compared"
"""What becomes of the ends of a recording that an input does not reach."""
AS_TRUE = "a fit takes each for measured, and one can spoil it"
"""What becomes of a stray sample."""
AS_NEW = "the repeats count as measured"
"""What becomes of a repeated value."""


def starts_over(channel: Channel) -> Turnover | None:
    """Return the turn that a channel of an angle or a length loses time and again, if it does."""
    sound = channel.unit in ("rad", "m") and channel.values.shape == channel.time.shape
    return turnover(channel.values, channel.unit, channel.time) if sound else None


def turnover_text(channel: Channel, found: Turnover) -> str:
    """Return what was seen of a counter: how often it jumps, when first, and by how much."""
    times = "once" if len(found.samples) == 1 else f"{len(found.samples)} times"
    size = f"{found.turn:.6g} {channel.unit}"
    turn = f"one turn, {size}," if found.steps is None else f"{size}, {found.steps} steps of its resolution,"
    first = f"first at {channel.time[found.samples[0]]:.4f} s"
    return f"channel '{channel.name}' jumps {times} by {turn} within one sample, {first}: it starts over like a counter"


def missing(channel: Channel) -> tuple[tuple[float, float], ...]:
    """Return the gaps in the samples of a channel, from when to when."""
    sound = channel.values.shape == channel.time.shape
    return gaps(channel.time[np.isfinite(channel.values)]) if sound else ()


def gap_texts(channels: Iterable[Channel]) -> Iterator[str]:
    """Yield what is to be said of gaps in the samples of channels; those with the same gaps stand in one sentence."""
    found: dict[tuple[tuple[float, float], ...], list[Channel]] = {}
    for channel in channels:
        found.setdefault(missing(channel), []).append(channel)
    for places, having in found.items():
        if places:
            longest = max(places, key=lambda gap: gap[1] - gap[0])
            usual = float(np.median(np.diff(having[0].time[np.isfinite(having[0].values)])))
            names = ", ".join(f"'{channel.name}'" for channel in having)
            more = f" (the longest of {len(places)} gaps)" if len(places) > 1 else ""
            yield (
                f"no samples of {names} from {longest[0]:.4f} s to {longest[1]:.4f} s, {longest[1] - longest[0]:.3g} s "
                f"where {usual:.3g} s is usual{more}"
            )


def end_texts(channel: Channel, begin: float, end: float) -> Iterator[tuple[str, str]]:
    """Yield what is to be said of the ends of a span, s, that the samples of a channel do not reach, and what to do."""
    time = channel.time[np.isfinite(channel.values)]
    for first, last in unseen_ends(time, begin, end):
        early = last <= time[0]
        side, key, at = ("before its first", "from", last) if early else ("after its last", "to", first)
        text = f"no samples of '{channel.name}' from {first:.4f} s to {last:.4f} s, {side}: {last - first:.3g} s"
        yield text, f"state `{key}: {at:.10g}` beside the file in the problem, or add the samples or align the clocks"


def _span_beside(channel: Channel, recording: Recording) -> tuple[float, float]:
    """Return from when to when the channels of a recording have samples whose own time overlaps that of one of them."""
    spans = [span for item in recording.channels.values() if (span := _span(item)) is not None]
    own = _span(channel)
    met = [span for span in spans if own is not None and span[0] < own[1] and own[0] < span[1]]
    return min((span[0] for span in met), default=0.0), max((span[1] for span in met), default=0.0)


def _span(channel: Channel) -> tuple[float, float] | None:
    time = channel.time[np.isfinite(channel.values)]
    return (float(time[0]), float(time[-1])) if time.size else None


def strays_text(channel: Channel) -> str | None:
    """Return what is seen of samples that leave a channel and come back; None without any, or where it starts over."""
    found = excursions(channel)
    if not found.size or starts_over(channel) is not None:
        return None
    values = channel.values[found]
    size, place = ("1 sample", "at") if found.size == 1 else (f"{found.size} samples", "first at")
    first = f"{place} {channel.time[found[0]]:.4f} s with {values[0]:.6g} {channel.unit}"
    return (
        f"channel '{channel.name}' leaves its course for {size} and comes back, {first}: farther than any motion goes"
    )


def repeats(channel: Channel) -> int | None:
    """Return how many times a channel repeats every value, if it does."""
    return held_for(channel.values) if channel.values.shape == channel.time.shape else None


def repeats_text(channel: Channel, count: int) -> str:
    """Return what was seen of a channel whose values are repeated."""
    usual = float(np.median(np.diff(channel.time)))
    seldom = f"a new one comes every {count * usual:.3g} s, not every {usual:.3g} s"
    return f"channel '{channel.name}' repeats every value {count} times: {seldom}"


def doubts_of_import(recording: Recording, import_map: ImportMap) -> tuple[Finding, ...]:
    """Return what is doubtful about a recording that a map made, and what to write into the map."""
    findings: list[Finding] = []
    for name, entry in import_map.channels.items():
        findings += _doubts_of_channel(recording.channels[name], entry, f"{import_map.where}: channels.{name}")
    remedy = "split the log there if the machine moved meanwhile"
    if any(entry.wrap is not None for entry in import_map.channels.values()):
        remedy += ": of a counter, whole turns are lost in it"
    where = str(recording.path or recording.name)
    found = gap_texts(recording.channels.values())
    findings += [Finding(where, text, ACROSS_GAPS, remedy, "warning") for text in found]
    for channel in recording.channels.values():
        for text, way_out in end_texts(channel, *_span_beside(channel, recording)):
            findings.append(Finding(where, text, f"if it is an input: {AT_ENDS}", way_out, "warning"))
    return tuple(findings)


def _doubts_of_channel(channel: Channel, entry: Column, where: str) -> Iterator[Finding]:
    counter, count = starts_over(channel), repeats(channel)
    if counter is not None:
        remedy = f"write `wrap: {_in_column(entry, counter.turn)}` there if it counts what does not jump"
        yield Finding(where, turnover_text(channel, counter), "", remedy, "warning")
    if (strays := strays_text(channel)) is not None:
        yield Finding(where, strays, AS_TRUE, "leave these values empty in the log, or make them NaN", "warning")
    if count is not None:
        remedy = f"write `held: {count}` there, which keeps the first of each, unless it is a command that is held"
        yield Finding(where, repeats_text(channel, count), AS_NEW, remedy, "warning")


def _in_column(entry: Column, turn: float) -> str:
    """Return a turn in the numbers of its column."""
    unit = entry.unit or (header_unit(entry.column) if isinstance(entry.column, str) else "")
    try:
        size = float(to_si(1.0, unit, scale=entry.scale)[0])
    except FrictionOcpError:
        return f"<{turn:.10g} in SI, in the numbers of the column>"
    return f"{abs(turn / size):.10g}"

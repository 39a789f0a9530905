"""Pieces of a log: what a problem uses of a recording, from one time on and before another."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf, isfinite

import numpy as np

from friction_ocp.drive.parts import Drive
from friction_ocp.estimation.clocks import log_start, stamped
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.recording.recording import Channel
from friction_ocp.simulation.grid import first_tick


@dataclass(frozen=True)
class Span:
    """From `begin` on and before `end`, s on the clock of a recording; pieces that meet share no sample."""

    begin: float = -inf
    end: float = inf

    @property
    def is_all(self) -> bool:
        """Whether nothing is cut off."""
        return not isfinite(self.begin) and not isfinite(self.end)

    def named(self, recording: str) -> str:
        """Return what results call this piece of a recording: run_from_10_to_20."""
        ends = (("from", self.begin), ("to", self.end))
        return "_".join([recording, *(f"{word}_{end:.15g}" for word, end in ends if isfinite(end))])

    def holds(self, channel: Channel) -> bool:
        """Whether any sample of a channel lies within."""
        return bool(np.any((channel.time >= self.begin) & (channel.time < self.end)))


def hull(spans: Iterable[Span]) -> Span:
    """Return the shortest span that holds all of some."""
    known = list(spans)
    return Span(min(span.begin for span in known), max(span.end for span in known))


def piece_of(use: RecordingUse, drive: Drive, span: Span, within: Span) -> RecordingUse:
    """Return the use of a piece of a recording of which `within` is used in all.

    Time counts from where that begins, in all its pieces: a machine that warms up in the first is warm in the second.
    A sampled controller computes at the first sample of a piece, so that begins with a tick. Inputs with stamps of
    their own keep a sample beyond either end, so that they are known up to it. Channels that other clocks stamp are cut
    where these show the same time, at their guesses.
    """
    began = log_start(use.recording, drive)
    zero = within.begin if isfinite(within.begin) else began
    recording = replace(use.recording, log_began=began, counted_from=zero)
    whole = replace(use, recording=recording)
    if span.is_all:
        return whole
    outputs = [recording.channels[item.name] for item in drive.outputs if item.name in recording.channels]
    compared, samples = {item.clock for item in outputs}, [item.time for item in outputs if item.time.size]
    begin = first_tick(drive.controller, np.unique(np.concatenate(samples)), span.begin) if samples else span.begin
    channels = dict[str, Channel]()
    for name, channel in recording.channels.items():
        ends = tuple(stamped(whole, drive, name, at) for at in (begin, span.end))
        first, last = (int(at) for at in np.searchsorted(channel.time, ends))
        if channel.clock not in compared:
            first, last = max(first - 1, 0), last + 1
        kept = slice(first, last)
        channels[name] = replace(channel, time=channel.time[kept], values=channel.values[kept])
    return replace(use, recording=replace(recording, name=span.named(recording.name), channels=channels))

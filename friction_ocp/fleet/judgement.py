"""Which series drift and which nights stand out, at one rate of false alarms for the whole fleet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.execution.content import fingerprint
from friction_ocp.fleet import drift, outliers
from friction_ocp.fleet.drift import DriftTest, drift_test
from friction_ocp.fleet.scatter import Level, level_of
from friction_ocp.simulation.grid import BoolArray, FloatArray

Key = tuple[str, str]
"""Machine and parameter."""


@dataclass(frozen=True)
class Series:
    """The estimates of one parameter of one machine, in order of time."""

    machine: str
    parameter: str
    unit: str
    fits: tuple[int, ...]
    """(n,) numbers of the fits."""
    time: FloatArray
    """(n,) days, or the number of the night where no time is known."""
    value: FloatArray
    std_error: FloatArray

    @property
    def key(self) -> Key:
        """Machine and parameter."""
        return self.machine, self.parameter

    def without(self, left_out: BoolArray) -> Series:
        """Return the series without some nights."""
        kept = ~left_out
        fits = tuple(number for number, keep in zip(self.fits, kept, strict=True) if keep)
        arrays = {name: getattr(self, name)[kept] for name in ("time", "value", "std_error")}
        return replace(self, fits=fits, **arrays)


@dataclass(frozen=True)
class Drift:
    """A series and its test."""

    series: Series
    test: DriftTest
    adjusted: float
    """The p-value corrected for the number of series (Holm 1979)."""
    flagged: bool


@dataclass(frozen=True)
class Outlier:
    """A night that the others of its series do not explain."""

    series: Series
    place: int
    """Its place in the series."""
    expected: float
    distance: float
    """In deviations of the night."""
    adjusted: float
    """The p-value corrected for the number of nights and series (Bonferroni)."""


@dataclass(frozen=True)
class Judgement:
    """What is to be told of a fleet."""

    rate: float
    """Probability that a fleet in which nothing changes gets any flag at all."""
    drifts: tuple[Drift, ...]
    """Every series that is long enough, smallest p-value first."""
    outliers: tuple[Outlier, ...]
    levels: Mapping[Key, Level]
    """Level of every series without its outliers; of one that drifts, level and change."""

    @property
    def flagged(self) -> tuple[Drift, ...]:
        """Series that drift."""
        return tuple(item for item in self.drifts if item.flagged)


def judge(series: Sequence[Series], rate: float, seed: int = 0) -> Judgement:
    """Look for drifts and for nights that stand out, half of the rate each.

    Drifts are looked for first, on all nights; a night then stands out from the level of its series, or from its
    drift. Where nights were taken out, drifts are looked for once more, so that none hides behind an outlier. In a
    fleet without change a flag needs a drift on all nights or a night that stands out from a level: each happens in
    at most half the rate.
    """
    share = 0.5 * rate
    drifts = _drifts(series, share, seed)
    found = _outliers(series, drifts, share)
    if found:
        drifts = _drifts(_without(series, found), share, seed)
        found = _outliers(series, drifts, share)
    kept = _without(series, found)
    moving = {item.series.key: item.test.level for item in drifts if item.flagged}
    levels = {item.key: moving.get(item.key) or _plain_level(item) for item in kept if item.value.size}
    return Judgement(rate, tuple(sorted(drifts, key=lambda item: item.test.p_value)), found, levels)


def _plain_level(series: Series) -> Level:
    return level_of(np.ones((series.value.size, 1)), series.value, series.std_error)


def _drifts(series: Sequence[Series], level: float, seed: int) -> list[Drift]:
    """Test every series that is long enough; flags by Holm's step-down, which needs no independence."""
    long = [item for item in series if item.value.size >= drift.FEWEST]
    tests = [
        drift_test(item.time, item.value, item.std_error, level / len(long), _random(seed, item.key)) for item in long
    ]
    order = sorted(range(len(long)), key=lambda k: tests[k].p_value)
    adjusted = np.ones(len(long))
    largest = 0.0
    for place, k in enumerate(order):
        largest = max(largest, min(1.0, (len(long) - place) * tests[k].p_value))
        adjusted[k] = largest
    return [Drift(item, test, float(p), bool(p <= level)) for item, test, p in zip(long, tests, adjusted, strict=True)]


def _random(seed: int, key: Key) -> np.random.Generator:
    """Return a generator that does not depend on which other series there are."""
    return np.random.default_rng([seed, int(fingerprint(*key)[:12], 16)])


def _outliers(series: Sequence[Series], drifts: Sequence[Drift], level: float) -> tuple[Outlier, ...]:
    """Take the farthest night out of its series, as long as it is significant among all nights of all series."""
    shapes = {item.series.key: item for item in drifts if item.flagged}
    long = [item for item in series if item.value.size >= outliers.FEWEST]
    nights = sum(item.value.size for item in long)
    return tuple(found for item in long for found in _outliers_of(item, shapes.get(item.key), level, nights))


def _outliers_of(series: Series, moving: Drift | None, level: float, nights: int) -> list[Outlier]:
    design = _design(series, moving)
    out = np.zeros(series.value.size, dtype=np.bool_)
    found: list[Outlier] = []
    while series.value.size - int(out.sum()) >= outliers.FEWEST:
        inside = np.flatnonzero(~out)
        distance, p_values = outliers.unlikeness(design[inside], series.value[inside], series.std_error[inside])
        k = int(np.argmin(p_values))
        adjusted = min(1.0, nights * float(p_values[k]))
        if adjusted > level:
            break
        place = int(inside[k])
        out[place] = True
        rest = level_of(design[~out], series.value[~out], series.std_error[~out])
        expected = float(design[place] @ rest.coefficients)
        found.append(Outlier(series, place, expected, float(distance[k]), adjusted))
    return found


def _design(series: Series, moving: Drift | None) -> FloatArray:
    """Return (n, 1) a level, or (n, 2) level and change of a drift, at every night of a series."""
    ones = np.ones(series.value.size)
    if moving is None:
        return ones[:, None]
    column = np.interp(series.time, moving.series.time, moving.test.shape.column)
    return np.column_stack([ones, column])


def _without(series: Sequence[Series], found: Sequence[Outlier]) -> list[Series]:
    kept: list[Series] = []
    for item in series:
        out = np.zeros(item.value.size, dtype=np.bool_)
        out[[outlier.place for outlier in found if outlier.series.key == item.key]] = True
        kept.append(item.without(out))
    return kept

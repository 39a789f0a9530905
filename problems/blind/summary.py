"""The score of a suite from its judged cases: one line a requirement."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from blind.arithmetic import calibration, expected_error, log_score, mcnemar, share_interval
from blind.judging import Judged

LONGEST = 180.0
"""Seconds that a diagnosis may take on two processors."""


@dataclass(frozen=True)
class Line:
    """A requirement, what was measured for it, and whether that is enough; None where nothing is required."""

    what: str
    measured: str
    passed: bool | None = None


@dataclass(frozen=True)
class Checked:
    """What was checked about one case beyond its result."""

    reached: float | None = None
    """Share of the excess that is gone on fresh recordings."""
    confirmed: tuple[bool, ...] = ()
    """By rival in an alias set."""
    baselines: Mapping[str, bool] | None = None
    """Whether each baseline is right."""


def summary(judged: Sequence[Judged], checked: Mapping[str, Checked], failed: int) -> list[Line]:
    """Return the table of a suite."""
    one = _of(judged, "one")
    lines = [
        _least("cause right, first or in an alias set of two", (item.cause for item in one), 0.90),
        _least("place right", (item.place for item in one), 0.95),
        _alarms(judged),
        _least(
            "outside the catalogue called unknown", (item.unknown for item in judged if item.kind == "outside"), 0.8
        ),
        _least("both of two effects found", (item.both for item in judged if item.kind == "two"), 0.70),
        _spurious(judged),
        *_aliases(judged, checked),
        *_confidence(judged),
        _promise(judged, checked),
        *_time(judged, failed),
    ]
    return lines + _rivals(judged, checked)


def _of(judged: Sequence[Judged], kind: str) -> list[Judged]:
    return [item for item in judged if item.kind == kind]


def _share(hits: int, count: int) -> str:
    low, high = share_interval(hits, count) if count else (0.0, 1.0)
    return f"{hits} of {count} = {hits / max(count, 1):.1%} [{low:.1%}, {high:.1%}]"


def _least(what: str, marks: Iterable[bool | None], wanted: float) -> Line:
    values = [bool(mark) for mark in marks]
    passed = np.mean(values) >= wanted if values else None
    return Line(f"{what}, at least {wanted:.0%}", _share(sum(values), len(values)), _plain(passed))


def _plain(passed: object) -> bool | None:
    return None if passed is None else bool(passed)


def _alarms(judged: Sequence[Judged]) -> Line:
    silent = [bool(item.silent) for item in judged if item.kind == "none"]
    alarms = len(silent) - sum(silent)
    passed = alarms <= 0.05 * len(silent) if silent else None
    return Line("false alarms without an effect, at most 3 in 60", _share(alarms, len(silent)), passed)


def _spurious(judged: Sequence[Judged]) -> Line:
    inside = [item.spurious for item in judged if item.kind != "outside"]
    beyond = [item.spurious for item in judged if item.kind == "outside"]
    total = sum(inside) + sum(beyond)
    measured = f"{total / max(len(judged), 1):.3f}; {sum(beyond)} of {total} where the effect is outside the catalogue"
    return Line("spurious effects per case, at most 0.05", measured, total <= 0.05 * len(judged))


def _aliases(judged: Sequence[Judged], checked: Mapping[str, Checked]) -> list[Line]:
    some = [item for item in judged if item.alias_sizes]
    sizes = [size for item in some for size in item.alias_sizes]
    counts = ", ".join(f"{sizes.count(size)} of {size}" for size in sorted(set(sizes))) or "none"
    rivals = [mark for item in judged if item.case in checked for mark in checked[item.case].confirmed]
    return [
        Line("cases with an alias set, at most 15 %", _share(len(some), len(judged)), len(some) <= 0.15 * len(judged)),
        Line("sizes of alias sets", counts),
        Line("rivals confirmed on noise-free data, all", _share(sum(rivals), len(rivals)), all(rivals)),
    ]


def _confidence(judged: Sequence[Judged]) -> list[Line]:
    asked = [item for item in judged if item.stated and sum(p for p, _ in item.stated) > 0]
    if not asked:
        return []
    bins = calibration([item.stated for item in asked], np.random.default_rng(0))
    rows = [f"{b.stated:.2f}: {b.observed:.2f} [{b.band[0]:.2f}, {b.band[1]:.2f}]" for b in bins]
    return [
        Line("log score, 0 is perfect", f"{log_score([item.probability for item in asked]):.3f}"),
        Line("calibration, stated: observed [band]", ", ".join(rows), all(b.inside for b in bins)),
        Line("expected calibration error", f"{expected_error(bins):.4f}"),
    ]


def _promise(judged: Sequence[Judged], checked: Mapping[str, Checked]) -> Line:
    pairs = [
        (item.promised, checked[item.case].reached)
        for item in judged
        if item.promised is not None and item.case in checked and checked[item.case].reached is not None
    ]
    near = [abs(promised - gained) <= 0.1 for promised, gained in pairs if promised is not None and gained is not None]
    passed = float(np.mean(near)) >= 0.9 if near else None
    return Line("promised shrinkage within 0.1 of reached, at least 90 %", _share(sum(near), len(near)), passed)


def _time(judged: Sequence[Judged], failed: int) -> list[Line]:
    seconds = [item.seconds for item in judged]
    middle, most = (float(np.median(seconds)), max(seconds)) if seconds else (0.0, 0.0)
    return [
        Line("median time, at most 45 s", f"{middle:.0f} s", middle <= 45.0),
        Line(f"longest time, at most {LONGEST:.0f} s", f"{most:.0f} s", most <= LONGEST),
        Line("diagnoses without a result, none", str(failed), failed == 0),
    ]


def _rivals(judged: Sequence[Judged], checked: Mapping[str, Checked]) -> list[Line]:
    """Compare with each baseline on cases of one effect or none: neither baseline can say more."""
    lines: list[Line] = []
    plain = [item for item in judged if item.kind in ("none", "one")]
    known = {item.case: checked[item.case].baselines or {} for item in plain if item.case in checked}
    for name in sorted({name for marks in known.values() for name in marks}):
        pairs = [(item.right, known[item.case][name]) for item in plain if name in known.get(item.case, {})]
        ours, theirs = [a for a, _ in pairs], [b for _, b in pairs]
        lead, p_value = float(np.mean(ours) - np.mean(theirs)), mcnemar(ours, theirs)
        measured = f"{np.mean(ours):.1%} against {np.mean(theirs):.1%} on {len(pairs)} cases, McNemar p = {p_value:.2g}"
        lines.append(Line(f"10 points better than {name}, p < 0.01", measured, lead >= 0.1 and p_value < 0.01))
    return lines


def confusion(judged: Sequence[Judged]) -> tuple[list[str], list[str], np.ndarray]:
    """Return rows (truth), columns (what was said first) and counts; two-effect cases are left out."""
    pairs = [
        ("no effect" if item.kind == "none" else item.truth[0], item.said) for item in judged if item.kind != "two"
    ]
    rows = sorted({truth for truth, _ in pairs})
    columns = sorted({said for _, said in pairs}, key=lambda said: (said not in rows, said))
    counts = np.zeros((len(rows), len(columns)), dtype=int)
    for truth, said in pairs:
        counts[rows.index(truth), columns.index(said)] += 1
    return rows, columns, counts

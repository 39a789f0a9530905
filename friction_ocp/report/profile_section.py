"""The section of profile likelihoods."""

from __future__ import annotations

from friction_ocp.plots.numbers import significant, to_resolution, unit_text
from friction_ocp.plots.profiles import PROFILE_WORDS
from friction_ocp.plots.reading import Json, objects, rows
from friction_ocp.report.section import Column, StatisticSection, StatisticTable, columns, interval_text, listed

_END_WORDS = {
    "threshold": "",
    "bound": "open up to its bound",
    "far": "open as far as it was followed",
    "points": "not followed to its end",
    "solver": "the solver failed",
    "failed": "failed",
}
_NOTES = (
    "One parameter is held, the others are optimal. Dashed: the 95 % threshold; dotted: the parabola of the standard "
    "error; shaded: what the recordings do not exclude.",
    "Twice the rise of the objective is divided by the scale, sandwich variance over inverse information, which is 1 "
    "for white residuals of the stated noise.",
)


def profile_section(found: Json, result: Json) -> StatisticSection:
    """Say which parameters have a finite interval, and give all of them."""
    items = objects(found, "parameters")
    words = {word: [name for name, item in items.items() if item["verdict"] == word] for word in PROFILE_WORDS}
    sentence = f"{len(words['finite'])} of {len(items)} parameters have a finite likelihood interval"
    for word in ("one_sided", "flat"):
        sentence += f"; {PROFILE_WORDS[word][0]}: {listed(words[word])}" if words[word] else ""
    heads = columns("Parameter | Unit", "Value | Likelihood interval | From the standard error | Scale")
    cells = tuple(_row(name, item, objects(result, "parameters")[name]) for name, item in items.items())
    table = StatisticTable(
        "Likelihood intervals at 95 % beside those of the standard error.",
        (*heads, Column("Verdict", False), Column("Remark", False)),
        cells,
    )
    picture = "Profile likelihood of every parameter"
    return StatisticSection("Profile likelihood", "Profiles", f"{sentence}.", _NOTES, picture, (table,))


def _row(name: str, item: Json, parameter: Json) -> tuple[str, ...]:
    std_error = item.get("std_error")
    remarks = zip(("below", "above"), rows(item, "ends"), strict=True)
    return (
        name,
        unit_text(str(item["unit"])),
        to_resolution(item["value"], std_error),
        interval_text(rows(item, "interval95"), std_error),
        interval_text(rows(parameter, "interval95"), std_error),
        significant(item["scale"], 3),
        PROFILE_WORDS[str(item["verdict"])][0],
        "; ".join(f"{side}: {_END_WORDS[end]}" for side, end in remarks if _END_WORDS[end]),
    )

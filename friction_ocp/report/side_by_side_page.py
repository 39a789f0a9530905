"""The page of several results, and the same in plain text."""

from __future__ import annotations

from pathlib import Path

from friction_ocp.plots.numbers import NOTHING, percent, significant, to_resolution, unit_text
from friction_ocp.plots.reading import Json, objects, rows
from friction_ocp.plots.side_by_side import side_by_side_figure
from friction_ocp.plots.style import figure_style, svg_text
from friction_ocp.report.page import render_page
from friction_ocp.report.pictures import embedded_svg
from friction_ocp.report.section import StatisticSection, StatisticTable, columns, table_lines
from friction_ocp.whole_file import write_text

NOTABLE = 3.0
"""Standard deviations from which a difference is counted."""


def write_side_by_side(document: Json, path: Path) -> None:
    """Write report.html in one step."""
    write_text(path, render_side_by_side(document))


def render_side_by_side(document: Json) -> str:
    """Return the page."""
    with figure_style():
        figure = embedded_svg(svg_text(side_by_side_figure(document)))
    section = StatisticSection(
        kind="Results side by side",
        title="Parameters and errors",
        sentence=side_by_side_sentence(document),
        notes=("Differences are those to the first result.",),
        picture="Every parameter in every result, with 95 % intervals",
        tables=_tables(document),
        figure=figure,
    )
    context = {
        "title": str(document["title"]),
        "statistic": section,
        "warnings": rows(document, "notes"),
        "results": rows(document, "results"),
    }
    return render_page("side_by_side.html", context)


def side_by_side_sentence(document: Json) -> str:
    """Say how many parameters differ beyond chance."""
    found = [item for each in objects(document, "parameters").values() for item in rows(each, "differences") if item]
    told = [item for item in found if item["deviations"] is not None]
    if not told:
        what = f"{len(found)} estimates stand beside those of the first result"
        return f"{what}; the results share recordings, so that chance cannot be told from difference."
    beyond = sum(abs(float(item["deviations"])) > NOTABLE for item in told)
    return f"{beyond} of {len(told)} estimates are more than {NOTABLE:g} standard deviations from the first result's."


def side_by_side_text(document: Json) -> str:
    """Return notes and tables as plain text."""
    lines = [str(document["title"]), "", side_by_side_sentence(document), ""]
    lines += [f"! {note}" for note in rows(document, "notes")]
    return "\n".join([*lines, *(line for table in _tables(document) for line in ("", *table_lines(table)))])


def _tables(document: Json) -> tuple[StatisticTable, ...]:
    names = [str(item["name"]) for item in rows(document, "results")]
    found = objects(document, "parameters")
    in_deviations = any(
        item and item["deviations"] is not None for each in found.values() for item in rows(each, "differences")
    )
    heads = [names[0], *(f"{name}|difference" + ("|in deviations" if in_deviations else "") for name in names[1:])]
    parameters = tuple(_parameter(name, item, in_deviations) for name, item in found.items())
    errors = tuple(_error(item) for item in rows(document, "errors"))
    told = StatisticTable("Parameters.", columns("Parameter | Unit", "|".join(heads)), parameters)
    if not errors:
        return (told,)
    caption = "Errors of the free run, rms."
    return told, StatisticTable(caption, columns("Channel | Recordings | Unit", "|".join(names)), errors)


def _parameter(name: str, item: Json, in_deviations: bool) -> tuple[str, ...]:
    first, *others = rows(item, "values")
    cells = [_value(first)]
    for found, difference in zip(others, rows(item, "differences"), strict=True):
        known: Json = difference or {}
        relative = known.get("relative")
        told = percent(relative, 2) if relative is not None else significant(known.get("absolute"), 3)
        cells += [_value(found), told, *([significant(known.get("deviations"), 2)] if in_deviations else [])]
    return (name, unit_text(str(item["unit"])), *cells)


def _value(found: Json | None) -> str:
    if found is None:
        return NOTHING
    word = str(found.get("verdict") or "ok")
    text = to_resolution(found["value"], found.get("std_error"))
    return text if word == "ok" else f"{text} ({word.replace('_', ' ')})"


def _error(item: Json) -> tuple[str, ...]:
    numbers = (significant(value, 3) for value in rows(item, "rms"))
    return str(item["channel"]), str(item["split"]), unit_text(str(item["unit"])), *numbers

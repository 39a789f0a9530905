"""The one page of a fleet; its figures are inside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from friction_ocp.plots.fleet import fleet_figures
from friction_ocp.plots.numbers import percent, significant, to_resolution, unit_text
from friction_ocp.plots.reading import Json, objects, rows
from friction_ocp.plots.style import figure_style, svg_text
from friction_ocp.report.fleet_words import (
    drift_sentence,
    flagged,
    fleet_sentence,
    outlier_sentence,
    short_time,
    when_text,
)
from friction_ocp.report.page import facts, paragraphs, render_page
from friction_ocp.report.pictures import embedded_svg
from friction_ocp.report.section import interval_text
from friction_ocp.report.tables import Cell
from friction_ocp.whole_file import write_text


def write_fleet_report(result: Json, path: Path) -> None:
    """Write report.html in one step."""
    write_text(path, render_fleet(result))


def render_fleet(result: Json) -> str:
    """Return the page."""
    with figure_style():
        figures = {name: embedded_svg(svg_text(one)) for name, one in fleet_figures(result)}
    provenance = {key: value for key, value in result["provenance"].items() if not isinstance(value, Mapping | list)}
    drifts, outliers = flagged(result), rows(result, "outliers")
    return render_page(
        "fleet.html",
        {
            **{key: str(result.get(key) or "") for key in ("title", "problem", "message")},
            "question": paragraphs(str(result.get("question") or "")),
            "sentence": fleet_sentence(result),
            "calm": not drifts and not outliers,
            "warnings": rows(result, "warnings"),
            "drifts": [drift_sentence(item) for item in drifts],
            "outliers": [outlier_sentence(item) for item in outliers],
            "tests": [_test(item) for item in rows(result, "drifts")],
            "levels": _levels(result),
            "fits": [_fit(item) for item in rows(result, "fits")],
            "figures": figures,
            "provenance": facts(provenance),
        },
    )


def _test(item: Json) -> Sequence[Cell]:
    change = None if item["relative"] is None else abs(float(item["relative"]))
    return (
        Cell(str(item["machine"]), str(item["machine"])),
        Cell(str(item["parameter"]), str(item["parameter"])),
        Cell("drifts" if item["flagged"] else "steady", str(not item["flagged"])),
        Cell(significant(item["adjusted_p_value"], 2), float(item["adjusted_p_value"])),
        Cell(percent(item["relative"], 2), change),
        Cell(f"{item['shape']} after {when_text(item)}", str(item["shape"])),
    )


def _levels(result: Json) -> list[Sequence[Cell]]:
    return [
        (
            Cell(machine, machine),
            Cell(name, name),
            Cell(to_resolution(item["value"], item["std_error"]), float(item["value"])),
            Cell(unit_text(str(item["unit"])), str(item["unit"])),
            Cell(interval_text(rows(item, "interval95"), item["std_error"])),
            Cell(significant(item["night_scatter"], 2), float(item["night_scatter"])),
            Cell(str(item["fits"]), float(item["fits"])),
        )
        for machine, content in objects(result, "machines").items()
        for name, item in objects(content, "parameters").items()
    ]


def _fit(item: Json) -> Sequence[Cell]:
    values = ", ".join(
        f"{name} = {to_resolution(found['value'], found['std_error'])}{_verdict(found)}"
        for name, found in objects(item, "parameters").items()
    )
    status = str(item["status"]).replace("_", " ")
    told = status if item["status"] == "converged" else f"{status}: {item['message']}"
    return (
        Cell(str(item["machine"]), str(item["machine"])),
        Cell(str(item["recording"]), str(item["recording"])),
        Cell(short_time(str(item["started"])), str(item["started"])),
        Cell(told, status),
        Cell(values),
    )


def _verdict(found: Json) -> str:
    return "" if found["verdict"] == "ok" else f" ({str(found['verdict']).replace('_', ' ')})"

"""The section of a multi-start."""

from __future__ import annotations

from collections.abc import Sequence

from friction_ocp.plots.numbers import NOTHING, significant, unit_text
from friction_ocp.plots.reading import Json, objects, part, rows
from friction_ocp.report.section import StatisticSection, StatisticTable, columns

_SHOWN = 5  # optima that a table has columns for


def starts_section(found: Json, result: Json) -> StatisticSection:
    """Say how many starts agree, on what, and where the others end."""
    return StatisticSection(
        kind="Multi-start identification",
        title="Starts",
        sentence=_sentence(rows(found, "starts"), rows(found, "optima")),
        notes=("Starts fill a Latin hypercube within a factor √10 of the guess, inside the bounds.",),
        picture="Waterfall of the ends of all starts",
        tables=(_optima_table(found, objects(result, "parameters")), _starts_table(rows(found, "starts"))),
    )


def _sentence(starts: Sequence[Json], optima: Sequence[Json]) -> str:
    lowest = float(optima[0]["objective"])
    text = f"{optima[0]['starts']} of {len(starts)} starts reach the best optimum"
    for optimum in optima[1:4]:
        above = 100 * (float(optimum["objective"]) / lowest - 1) if lowest else float("nan")
        text += f", {optimum['starts']} end {significant(above, 2)} % above"
    if len(optima) > 4:
        text += f", {sum(optimum['starts'] for optimum in optima[4:])} higher still"
    missing = sum(start["optimum"] is None for start in starts)
    text += f", {missing} failed." if missing else "."
    return f"{text} The guess reaches it." if starts[0]["optimum"] == 0 else f"{text} The guess does not."


def _optima_table(found: Json, parameters: Json) -> StatisticTable:
    optima = rows(found, "optima")[:_SHOWN]
    heads = "|".join(f"Optimum {k + 1}" for k in range(len(optima)))
    hidden = len(rows(found, "optima")) - len(optima)
    caption = (
        f"Ends that are one optimum: objectives within {100 * float(found['same_objective']):g} %, parameters within "
        f"{found['same_parameter']:g} standard errors." + (f" {hidden} more optima are not shown." if hidden else "")
    )
    cells = [
        ("starts", "", *(str(optimum["starts"]) for optimum in optima)),
        ("objective", "", *(f"{float(optimum['objective']):.7g}" for optimum in optima)),
    ]
    cells += [
        (name, unit_text(str(item["unit"])), *(significant(part(optimum, "parameters")[name], 5) for optimum in optima))
        for name, item in parameters.items()
    ]
    return StatisticTable(caption, columns("Ends | Unit", heads), tuple(cells))


def _starts_table(starts: Sequence[Json]) -> StatisticTable:
    cells = tuple(
        (
            str(start["message"]),
            str(k + 1),
            NOTHING if start["optimum"] is None else str(start["optimum"] + 1),
            NOTHING if start["objective"] is None else f"{float(start['objective']):.7g}",
            NOTHING if start["iterations"] is None else str(start["iterations"]),
            significant(start["seconds"], 3),
        )
        for k, start in enumerate(starts)
    )
    heads = columns("How it ended", "Start | Optimum | Objective | Iterations | Seconds")
    return StatisticTable(
        "Every start, in order; the first is the guess.",
        (*heads[1:], heads[0]),
        tuple((*row[1:], row[0]) for row in cells),
    )

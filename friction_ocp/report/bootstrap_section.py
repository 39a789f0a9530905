"""The section of a bootstrap."""

from __future__ import annotations

from collections.abc import Sequence

from friction_ocp.plots.numbers import is_number, significant, to_resolution, unit_text
from friction_ocp.plots.reading import Json, objects, part, rows
from friction_ocp.report.section import StatisticSection, StatisticTable, columns, interval_text

_WAYS = {
    "refit": "and what the model says with these residuals is fitted again from the optimum.",
    "one_step": "and the optimum moves by the Gauss-Newton step of the resampled scores, within the bounds.",
}
_POINTS = "the error of every static point"


def bootstrap_section(found: Json, result: Json) -> StatisticSection:
    """Give the scatter of the draws beside the standard errors of the fit."""
    blocks: Sequence[Json] = rows(found, "blocks")
    points = objects(part(result, "fit"), "static").values()
    with_points = any(item["split"] == "train" for item in points)
    return StatisticSection(
        kind="Bootstrap",
        title="Bootstrap",
        sentence=_sentence(found),
        notes=(_note(found, blocks, with_points),),
        picture="Bootstrap draws of every parameter",
        tables=(
            _draws_table(objects(found, "parameters"), objects(result, "parameters")),
            *([_blocks_table(blocks)] if blocks else []),
        ),
    )


def _note(found: Json, blocks: Sequence[Json], with_points: bool) -> str:
    """Say what got random signs, and what became of it."""
    said = [_POINTS] if with_points else []
    if blocks:
        lengths = [float(block["length_s"]) for block in blocks]
        shortest, longest = significant(min(lengths), 2), significant(max(lengths), 2)
        said = [f"blocks of {shortest} to {longest} s of residuals, as long as their autocorrelation asks for", *said]
    what, verb = ", and ".join(said), ", get" if blocks else " gets"
    return f"{what[:1].upper()}{what[1:]}{verb} a random sign, {_WAYS[str(found['method'])]}"


def _sentence(found: Json) -> str:
    text = f"{found['drawn'] - found['failed']} draws"
    ratios = [
        float(item["std_error"]) / float(item["covariance_std_error"])
        for item in objects(found, "parameters").values()
        if is_number(item["covariance_std_error"]) and item["covariance_std_error"]
    ]
    if ratios:
        low, high = significant(min(ratios), 2), significant(max(ratios), 2)
        text += f" scatter by {low} to {high} times the standard errors of the fit"
    return f"{text}."


def _draws_table(items: Json, parameters: Json) -> StatisticTable:
    numbers = "Value | 95 % of the draws | From the standard error | Std. error of draws | Std. error of fit | Median"
    cells = tuple(
        (
            name,
            unit_text(str(item["unit"])),
            to_resolution(item["value"], item["std_error"]),
            interval_text(rows(item, "interval95"), item["std_error"]),
            interval_text(rows(parameters[name], "interval95"), item["std_error"]),
            significant(item["std_error"], 2),
            significant(item["covariance_std_error"], 2),
            to_resolution(item["median"], item["std_error"]),
        )
        for name, item in items.items()
    )
    return StatisticTable("Draws beside the standard errors of the fit.", columns("Parameter | Unit", numbers), cells)


def _blocks_table(blocks: Sequence[Json]) -> StatisticTable:
    cells = tuple(
        (
            str(block["recording"]),
            str(block["count"]),
            significant(block["length_s"], 3),
            significant(block["wanted_s"], 3),
        )
        for block in blocks
    )
    return StatisticTable("Blocks by recording.", columns("Recording", "Blocks | Length in s | Asked for in s"), cells)

"""The one page of a diagnosis; its figures are inside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from friction_ocp.plots.numbers import NOTHING, plain, significant, unit_text, whole_percent
from friction_ocp.plots.reading import Json, objects, part, rows
from friction_ocp.report.diagnosis_words import (
    alias_sentences,
    bias_sentences,
    blind_spot_sentences,
    diagnosis_sentence,
    round_sentence,
    superseded_sentences,
)
from friction_ocp.report.page import paragraphs, render_page
from friction_ocp.report.pictures import embedded_png
from friction_ocp.whole_file import write_text

LISTED = 6
"""Candidates that are listed at least in the table of a round."""


def write_diagnosis_report(result: Json, figures: Mapping[str, Path], path: Path) -> None:
    """Write report.html in one step; `figures` are PNG files by name."""
    write_text(path, render_diagnosis(result, figures))


def render_diagnosis(result: Json, figures: Mapping[str, Path]) -> str:
    """Return the page."""
    gap, following = part(result, "gap"), result.get("next_experiment")
    return render_page(
        "diagnosis.html",
        {
            **{key: str(result.get(key) or "") for key in ("title", "problem")},
            "verdict_word": str(result.get("verdict") or ""),
            "question": paragraphs(str(result.get("question") or "")),
            "sentence": diagnosis_sentence(result),
            "evaluated_on": rows(gap, "evaluated_on"),
            "horizon": plain(gap["horizon_s"], 3) if gap.get("horizon_s") is not None else "",
            "changed": bool(rows(result, "accepted")),
            "drifts": result.get("verdict") in ("no_gap", "explained"),
            "gap": [_gap_row(name, gap) for name in objects(gap, "before")],
            "rounds": [_round(item) for item in rows(result, "rounds")],
            "superseded": superseded_sentences(result),
            "aliases": alias_sentences(result),
            "blind": blind_spot_sentences(result),
            "biased": bias_sentences(result),
            "next": str(following["text"]) if following else "",
            "traces": [name for name in figures if name.startswith("before-after-")],
            "assumptions": rows(result, "assumptions"),
            "figures": {name: embedded_png(file) for name, file in figures.items()},
        },
    )


def _gap_row(name: str, gap: Json) -> dict[str, str]:
    before, after = objects(gap, "before")[name], objects(gap, "after")[name]
    return {
        "channel": name,
        "rms_before": significant(before["rms"], 3),
        "rms_after": significant(after["rms"], 3),
        "unit": unit_text(str(before["unit"])),
        "before": significant(before["noise_ratio"], 3),
        "after": significant(after["noise_ratio"], 3),
        "source": str(before["noise_source"]),
    }


def _round(item: Json) -> dict[str, Any]:
    """Return what a round decided, all candidates that were refitted and the most promising others."""
    causes = rows(item, "causes")
    refitted = sum(cause.get("refit_gain") is not None for cause in causes)
    listed = max(refitted, LISTED)
    return {
        "sentence": round_sentence(item),
        "refitted": bool(refitted),
        "causes": [_cause(cause) for cause in causes[:listed]],
        "others": max(len(causes) - listed, 0),
    }


def _cause(cause: Json) -> dict[str, Any]:
    refitted = cause.get("refit_gain") is not None
    values = part(cause, "parameters").items() if refitted else ()
    return {
        "effect": str(cause["effect"]).replace("_", " "),
        "meaning": str(cause.get("meaning") or ""),
        "component": str(cause["component"]),
        "probability": whole_percent(cause["probability"]) if refitted else NOTHING,
        "p_value": significant(cause.get("p_value"), 2),
        "predicted": _gain(cause.get("predicted_gain")),
        "refit": _gain(cause.get("refit_gain")),
        "heldout": _gain(cause.get("heldout_gain")),
        "parameters": [(name, significant(value, 3)) for name, value in values],
    }


def _gain(value: float | None) -> str:
    return NOTHING if value is None else f"{100 * value:.0f} %"

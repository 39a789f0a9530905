"""The one page of a design; its figures are inside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from friction_ocp.plots.numbers import percent, significant, unit_text
from friction_ocp.plots.reading import Json, objects, part, rows
from friction_ocp.report.design_words import chance, design_sentence, limits_sentence
from friction_ocp.report.page import paragraphs, render_page
from friction_ocp.report.pictures import embedded_png
from friction_ocp.whole_file import write_text

WORTH = {
    "D": "Worth: gain in the logarithm of the determinant of the information; 1.4 more halves the volume of the "
    "confidence region.",
    "A": "Worth: minus the mean of the squared relative standard errors that are left.",
    "separation": "Worth: squared distance of the rivals in noise floors, once the false one has adapted. Decides: the "
    "probability that one such recording tells which is true.",
}


def write_design_report(result: Json, figures: Mapping[str, Path], path: Path) -> None:
    """Write report.html in one step; `figures` are PNG files by name."""
    page = render_page(
        "design.html",
        {
            **{key: str(result.get(key) or "") for key in ("title", "problem")},
            "question": paragraphs(str(result.get("question") or "")),
            "sentence": design_sentence(result),
            "good": bool(rows(result, "options")),
            "limits": limits_sentence(result),
            "options": [_option(item) for item in rows(result, "options")],
            "parameters": _parameters(result),
            "decides": bool(rows(result, "separates")),
            "worth": WORTH.get(str(result.get("criterion")), ""),
            "figures": {name: embedded_png(file) for name, file in figures.items()},
        },
    )
    write_text(path, page)


def _option(item: Json) -> dict[str, str]:
    return {
        "motion": str(item["motion"]).replace("_", " "),
        "sentence": str(item["sentence"]),
        "amplitude": percent(float(item["amplitude"]), 2),
        "worth": "" if item["worth"] is None else significant(float(item["worth"]), 3),
        "power": "" if item["power"] is None else chance(float(item["power"])),
    }


def _parameters(result: Json) -> list[dict[str, str]]:
    """Return standard errors now and with the best motion, where the design is for them."""
    options = rows(result, "options")
    after = part(options[0] if options else {}, "std_errors")
    found: list[dict[str, str]] = []
    for name, item in objects(result, "parameters").items():
        if after.get(name) is not None and item["std_error_before"] is not None:
            numbers = {"value": item["value"], "before": item["std_error_before"], "after": after[name]}
            texts = {key: significant(float(number), 3) for key, number in numbers.items()}
            found.append({"name": name, "unit": unit_text(str(item["unit"])), **texts})
    return found

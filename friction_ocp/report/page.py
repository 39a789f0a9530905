"""One self-contained HTML file for a result: text, tables, plots and the library that draws them."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from friction_ocp.plots import palette
from friction_ocp.plots.numbers import plain, significant
from friction_ocp.plots.reading import Json, objects, part, rows
from friction_ocp.plots.series import Series
from friction_ocp.report.compensation import compensation_section
from friction_ocp.report.payload import (
    coherence_payload,
    embedded_json,
    friction_payload,
    recording_payload,
    residual_payload,
)
from friction_ocp.report.statistics import drawn_section, whole_verdict
from friction_ocp.report.tables import (
    SPLITS,
    correlation_rows,
    fit_rows,
    fit_rows_by_recording,
    parameter_rows,
    static_rows,
)
from friction_ocp.whole_file import write_text

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class EmbeddedRecording:
    """A recording with what the script needs to draw it, as JSON."""

    index: int
    name: str
    split: str
    traces: str
    residuals: str
    coherence: str


def write_report(result: Json, series: Series, path: Path) -> None:
    """Write report.html in one step: a reader sees the old file or the whole new one."""
    write_text(path, render_report(result, series))


def render_report(result: Json, series: Series) -> str:
    """Return the page of an identification."""
    friction = friction_payload(rows(result, "friction_curves"))
    solver, provenance = part(result, "solver"), dict(part(result, "provenance"))
    checksums = part(provenance, "recordings")
    for key in ("recordings", "problems"):
        provenance.pop(key, None)
    return render_page(
        "identify.html",
        {
            **{key: str(result.get(key) or "") for key in ("title", "problem", "message")},
            "question": paragraphs(str(result.get("question") or "")),
            "converged": result.get("status") == "converged",
            "sentence": whole_verdict(result),
            "statistic": drawn_section(result),
            "warnings": rows(result, "warnings"),
            "parameters": parameter_rows(objects(result, "parameters")),
            "process_noise": parameter_rows(objects(result, "process_noise")),
            "horizon": plain(part(result, "fit").get("horizon_s"), 3),
            "whole": part(result, "fit").get("horizon_s") is None,
            "fit": fit_rows(part(result, "fit")),
            "static": static_rows(part(result, "fit")),
            "parts": fit_rows_by_recording(part(result, "fit")),
            "recordings": _recordings(result, series),
            "any_traded": any(rows(item, "traded_with") for item in objects(result, "parameters").values()),
            "friction": friction,
            "friction_json": embedded_json(friction),
            "compensation": compensation_section(result),
            "residuals": objects(result, "residuals"),
            "coherence": any(objects(result, "coherence").values()),
            "correlation": correlation_rows(part(result, "correlation")),
            "solver": facts(solver),
            "provenance": facts(provenance),
            "checksums": checksums,
        },
    )


def paragraphs(text: str) -> list[str]:
    """Return the paragraphs of a question: without the line breaks within each, and without "Asked:" before it."""
    blocks = text.strip().removeprefix("Asked:").strip()
    found = [" ".join(block.split()) for block in blocks.split("\n\n") if block.strip()]
    return [found[0][:1].upper() + found[0][1:], *found[1:]] if found else []


def render_page(template: str, context: Mapping[str, Any]) -> str:
    """Fill a template of this package; only the page's own two scripts may run, and nothing may be loaded."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs  # pyright: ignore[reportMissingTypeStubs]

    def breakable(name: str) -> Markup:
        return Markup("<wbr>").join(re.split(r"(?<=[._@/-])", name))

    environment = Environment(
        loader=FileSystemLoader(_HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    library = str(get_plotlyjs())
    scripts = [library, (_HERE / "report.js").read_text(encoding="utf-8")]
    return environment.get_template(template).render(
        context,
        policy=_content_policy(scripts),
        plotly=Markup(library),  # trusted: a file of the installed plotly
        script=Markup(scripts[1]),
        style=Markup((_HERE / "report.css").read_text(encoding="utf-8")),
        palette=palette,
        literal=Markup,  # for what embedded_json has made safe
        breakable=breakable,
    )


def _recordings(result: Json, series: Series) -> list[EmbeddedRecording]:
    """Return the recordings in the order of the result, then any that only the series have."""
    splits = {str(name): split for key, split in SPLITS.items() for name in rows(part(result, "recordings"), key)}
    units, residuals, coherence = (part(result, key) for key in ("channel_units", "residuals", "coherence"))
    return [
        EmbeddedRecording(
            index,
            name,
            splits.get(name, "other"),
            embedded_json(recording_payload(series.get(name, {}), units)),
            embedded_json(residual_payload(objects(residuals, name))),
            embedded_json(coherence_payload(objects(coherence, name))),
        )
        for index, name in enumerate(dict.fromkeys([*splits, *series]))
    ]


_FACTS = {
    "code": "code, SHA-256",
    "model": "model, SHA-256",
    "seconds": "seconds, fit",
    "build_seconds": "seconds, build",
}


def facts(found: Json) -> dict[str, str]:
    """Return names and values as a person reads them, without what is not stated."""
    told = {_FACTS.get(str(key), str(key).replace("_", " ")): _fact(value) for key, value in found.items()}
    return {key: text for key, text in told.items() if text}


def _fact(value: Any) -> str:
    if isinstance(value, Mapping):
        content = cast("Json", value)
        if "name" in content:
            return f"{content['name']} {_fact(content.get('options'))}".rstrip()
        told = {key.replace("_", " "): _fact(item) for key, item in content.items()}
        return ", ".join(f"{key} {text}" for key, text in told.items() if text)
    if isinstance(value, list | tuple):
        return ", ".join(_fact(item) for item in cast("Sequence[Any]", value))
    if value is None:
        return ""
    return significant(value, 3) if isinstance(value, float) else str(value)


def _content_policy(scripts: Sequence[str]) -> str:
    """Return the Content-Security-Policy that allows these scripts by their hash and no network at all."""
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests)
    return f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:; font-src data:"

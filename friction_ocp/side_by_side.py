"""Results beside one another: parameters, errors, and what else is not the same."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.plots.reading import Json, objects, part, rows
from friction_ocp.repetition import VERSIONS, read_result

FORMAT = "friction-ocp-side-by-side/1"
SPLITS = ("train", "validation")


@dataclass(frozen=True)
class NamedResult:
    """A result and what it is called here."""

    name: str
    path: Path
    content: Json


def result_file(path: Path) -> Path | None:
    """Return the result that a path means, if it means one: a folder that holds one, or the file itself."""
    inside = path / "result.json" if path.is_dir() else path
    return inside if inside.suffix == ".json" and inside.is_file() else None


def read_results(paths: Sequence[Path]) -> list[NamedResult]:
    """Read results, named after their folders; raises FrictionOcpError for what is none or has nothing to compare."""
    found: list[NamedResult] = []
    findings: list[Finding] = []
    for path in paths:
        file = result_file(path)
        if file is None:
            what = "this is no result, as the others are"
            findings.append(Finding(str(path), what, "only results, or only problem files"))
            continue
        content = read_result(file)
        if not estimates_of(content):
            findings.append(
                Finding(str(path), "this result has no parameters", "an identification, statistic or batch")
            )
        stem = file.resolve().parent.name if file.name == "result.json" else file.stem
        taken = sum(other.name.partition(" (")[0] == stem for other in found)
        found.append(NamedResult(f"{stem} ({taken + 1})" if taken else stem, file, content))
    if findings:
        raise FrictionOcpError(findings)
    return found


def estimates_of(result: Json) -> Mapping[str, Json]:
    """Return the estimates of a result by name; of a fleet, the level of every parameter of every machine."""
    machines = objects(result, "machines")
    if not machines:
        return objects(result, "parameters")
    return {
        f"{machine}: {name}": item
        for machine, content in machines.items()
        for name, item in objects(content, "parameters").items()
    }


def side_by_side(results: Sequence[NamedResult]) -> dict[str, Any]:
    """Return the document that compares results; differences are those to the first.

    A difference is told in its standard deviations where the two results share no recording: estimates from the same
    recordings share their noise, and differ by less than their standard errors say.
    """
    first, *others = results
    names = dict.fromkeys(name for item in results for name in estimates_of(item.content))
    independent = [not _shared(first.content, other.content) for other in others]
    return {
        "format": FORMAT,
        "status": "compared",
        "title": f"{len(results)} results side by side",
        "results": [_heading(item) for item in results],
        "parameters": {name: _parameter(name, results, independent) for name in names},
        "errors": list(_errors(results)),
        "notes": list(_notes(results, independent)),
    }


def _heading(item: NamedResult) -> dict[str, Any]:
    made = part(item.content, "provenance")
    keys = ("format", "title", "problem", "status")
    return {
        "name": item.name,
        "path": item.path.as_posix(),
        **{key: item.content.get(key, "") for key in keys},
        "created": made.get("created", ""),
        "recordings": dict(part(made, "recordings")),
    }


def _parameter(name: str, results: Sequence[NamedResult], independent: Sequence[bool]) -> dict[str, Any]:
    found = [estimates_of(item.content).get(name) for item in results]
    known = [item for item in found if item is not None]
    keys = ("value", "std_error", "interval95", "verdict")
    return {
        "unit": known[0].get("unit", ""),
        "values": [None if item is None else {key: item.get(key) for key in keys} for item in found],
        "differences": [
            _difference(found[0], other, alone) for other, alone in zip(found[1:], independent, strict=True)
        ],
    }


def _difference(before: Json | None, after: Json | None, independent: bool) -> dict[str, Any] | None:
    if before is None or after is None:
        return None
    value, other = float(before["value"]), float(after["value"])
    errors = [item.get("std_error") for item in (before, after)]
    deviations = None
    if independent and all(isinstance(error, float) and error > 0 for error in errors):
        deviations = (other - value) / math.hypot(*(float(error) for error in errors if error))
    return {
        "absolute": other - value,
        "relative": (other - value) / abs(value) if value else None,
        "deviations": deviations,
    }


def _errors(results: Sequence[NamedResult]) -> Iterator[dict[str, Any]]:
    """Yield the rms errors of the free run by channel, wherever any result has them."""
    for split in SPLITS:
        tables = [objects(part(item.content, "fit"), split) for item in results]
        for channel in dict.fromkeys(name for table in tables for name in table):
            found = [table.get(channel) for table in tables]
            unit = next(str(item.get("unit", "")) for item in found if item is not None)
            rms = [None if item is None else item.get("rms") for item in found]
            yield {"split": split, "channel": channel, "unit": unit, "rms": rms}


def _shared(first: Json, other: Json) -> set[str]:
    ours, theirs = (set(part(part(item, "provenance"), "recordings").values()) for item in (first, other))
    return {str(digest) for digest in ours & theirs}


def _notes(results: Sequence[NamedResult], independent: Sequence[bool]) -> Iterator[str]:
    """Say what else than the parameters is not the same, and what the comparison rests on."""
    first, *others = results
    made = part(first.content, "provenance")
    for other, alone in zip(others, independent, strict=True):
        theirs = part(other.content, "provenance")
        for name in VERSIONS:
            if name in made and name in theirs and made[name] != theirs[name]:
                what = "code of friction-ocp" if name == "code" else name.replace("_", "-")
                yield f"{what}: {str(made[name])[:12]} in {first.name}, {str(theirs[name])[:12]} in {other.name}"
        if made.get("model") != theirs.get("model"):
            yield f"{first.name} and {other.name} fit different problems"
        if not alone:
            same = len(_shared(first.content, other.content))
            yield (
                f"{first.name} and {other.name} share {same} recordings and so their noise: differences are not told "
                "in standard deviations"
            )
    for item in results:
        if item.content.get("status") == "not_converged":
            yield f"{item.name} did not converge"
        for warning in rows(item.content, "warnings"):
            yield f"{item.name}: {warning}"


def save_side_by_side(document: Json, folder: Path) -> Path:
    """Write result.json, report.html and figures and return the folder."""
    from friction_ocp.plots.side_by_side import side_by_side_figure
    from friction_ocp.plots.style import figure_style, save
    from friction_ocp.report.side_by_side_page import write_side_by_side
    from friction_ocp.whole_file import write_text

    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "result.json", json.dumps(document, indent=1, allow_nan=False))
    (folder / "figures").mkdir(exist_ok=True)
    with figure_style():
        save(side_by_side_figure(document), folder / "figures" / "parameters")
    write_side_by_side(document, folder / "report.html")
    return folder

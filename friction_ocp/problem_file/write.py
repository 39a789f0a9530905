"""A problem as the text of a problem file, its drive written anew: for drives that no file described."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from friction_ocp.drive.parts import Channel, Clock, Drive, Shaft, Transmission
from friction_ocp.friction.composite import Bristled, added_terms, plain_law
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import NoFriction
from friction_ocp.parameters import Directional, Free, Tie, Value
from friction_ocp.problem_file.document import dump_document, read_document
from friction_ocp.problem_file.dump import rewrite_recordings, settle_estimation
from friction_ocp.problem_file.salvage import copy_content

_APART = ("drive", "controller", "channels", "clocks")


def write_problem(
    source: str | Path,
    drive: Drive,
    values: Mapping[str, float],
    folder: str | Path,
    max_step: float | None = None,
    text: str = "",
    horizon_s: float | None = None,
) -> str:
    """Return the text of a problem file for `folder`: the file `source` with another drive, its guesses replaced.

    `values` are fitted values by parameter name; the value of one recording, named `path@recording`, becomes a `set`
    beside its file. Paths of recordings are written relative to `folder`. `text` is the file as it was read, if that is
    known: it may have changed since. `max_step` and `horizon_s` are what the values belong to, unless the file states
    others.
    """
    source = Path(source)
    document = read_document(source, text or None)
    content = copy_content(document.content)
    written = drive_content(drive, values)
    fresh: dict[str, Any] = {}
    for key, item in content.items():
        if key not in _APART:
            fresh[key] = item
        elif key == "drive":
            fresh |= written
    rewrite_recordings(fresh, source, Path(folder), values)
    settle_estimation(fresh, max_step, horizon_s)
    return dump_document(fresh, document.head)


def drive_content(drive: Drive, values: Mapping[str, float] = {}) -> dict[str, Any]:
    """Return the sections `drive`, `controller` and `channels` that describe a drive, fitted values as guesses."""
    parts: dict[str, Any] = {}
    if drive.motors:
        parts["motors"] = [_part(motor, motor.name, values) for motor in drive.motors]
    parts["shafts"] = [_shaft(shaft, values) for shaft in drive.shafts]
    if drive.transmissions:
        parts["transmissions"] = [_transmission(item, values) for item in drive.transmissions]
    content: dict[str, Any] = {"drive": parts}
    if drive.controller is not None:
        content["controller"] = _part(drive.controller, "controller", values)
    content["channels"] = {item.name: _channel(item, values) for item in drive.channels}
    if drive.clocks:
        content["clocks"] = {item.name: _clock(item, values) for item in drive.clocks}
    return content


def _shaft(shaft: Shaft, values: Mapping[str, float]) -> dict[str, Any]:
    section = _part(dataclasses.replace(shaft, friction=FrictionElement(NoFriction())), shaft.name, values)
    section.pop("friction", None)
    if not isinstance(plain_law(shaft.friction.law), NoFriction):
        section["friction"] = _friction(shaft.friction, f"{shaft.name}.friction", values)
    return section


def _friction(element: FrictionElement, path: str, values: Mapping[str, float]) -> dict[str, Any]:
    law, terms = plain_law(element.law), added_terms(element.law)
    section = {"law": law.name, **_part(law, path, values)}
    if terms is not None:
        section["added"] = _part(terms, f"{path}.added", values)
    if isinstance(element.law, Bristled):
        section["bristle"] = _part(element.law.bristle, f"{path}.bristle", values)
    for item in dataclasses.fields(element):
        value = getattr(element, item.name)
        if item.name != "law" and value is not None:
            section[item.name] = _part(value, f"{path}.{item.name}", values)
    return section


def _transmission(item: Transmission, values: Mapping[str, float]) -> dict[str, Any]:
    section = _part(item, item.name, values)
    ends = {"from": section.pop("from_shaft"), "to": section.pop("to_shaft")}
    return {**ends, **section} if item.stiffness is not None else {**ends, **section, "stiffness": "rigid"}


def _channel(item: Channel, values: Mapping[str, float]) -> dict[str, Any]:
    section = _part(item, item.name, values)
    section.pop("name")
    return {**section, "role": item.role}


def _clock(item: Clock, values: Mapping[str, float]) -> dict[str, Any]:
    section = _part(item, item.path, values)
    section.pop("name")
    return section


def _part(part: Any, path: str, values: Mapping[str, float]) -> dict[str, Any]:
    """Return the fields of a part that differ from their defaults, numbers by their paths."""
    section: dict[str, Any] = {}
    for item in dataclasses.fields(part):
        value = getattr(part, item.name)
        if value is None or (item.default is not dataclasses.MISSING and value == item.default):
            continue
        section[item.name] = _written(value, f"{path}.{item.name}", values)
    return section


def _written(value: Value, path: str, values: Mapping[str, float]) -> Any:
    match value:
        case Free():
            return _free(value, path, values)
        case Tie():
            return {"expr": value.expr}
        case Directional():
            sides = {"positive": value.positive, "negative": value.negative}
            return {side: _written(item, f"{path}.{side}", values) for side, item in sides.items()}
        case tuple():
            items = cast(tuple[Any, ...], value)
            return [_written(item, f"{path}.{k}", values) for k, item in enumerate(items)]
        case bool() | int() | str():
            return value
        case float():
            return float(value)
        case _:
            return _part(value, path, values)


def _free(value: Free, path: str, values: Mapping[str, float]) -> dict[str, Any]:
    number: dict[str, Any] = {"guess": min(max(float(values.get(path, value.guess)), value.min), value.max)}
    number |= {"min": float(value.min)} if math.isfinite(value.min) else {}
    number |= {"max": float(value.max)} if math.isfinite(value.max) else {}
    if value.prior_std is not None:
        number |= {"prior_std": float(value.prior_std), "prior_mean": float(value.centre)}
    return number if value.scope == "shared" else {**number, "scope": value.scope}

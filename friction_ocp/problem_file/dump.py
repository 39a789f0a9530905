"""The problem with its answer: the same file, its guesses replaced by fitted values."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.expressions import closest
from friction_ocp.problem_file.document import dump_document, read_document
from friction_ocp.problem_file.load import recording_path, span_of
from friction_ocp.problem_file.salvage import copy_content, read_section
from friction_ocp.problem_file.schema import ProblemSection

_DIRECTIONS = ("positive", "negative")


def dump_problem(
    source: str | Path,
    values: Mapping[str, float],
    folder: str | Path,
    max_step: float | None = None,
    text: str = "",
    horizon_s: float | None = None,
) -> str:
    """Return the text of a problem file for `folder`: the file `source` with fitted values as its guesses.

    Bounds stay, and a prior stays where it was: its mean is written out. The value of one recording, named
    `path@recording`, becomes a `set` beside its file, the guess being left alone. Paths of recordings are written
    relative to `folder`. `max_step` s and `horizon_s` s are the integrator step and the judging windows that the values
    belong to, unless the file states others. `text` is the file as it was read, if that is known: it may have changed
    since.
    Comments other than those at the head are lost. Raises FrictionOcpError for a name that is
    not fitted in the file.
    """
    source = Path(source)
    document = read_document(source, text or None)
    section, faults = read_section(document.content)
    if section is None:
        raise FrictionOcpError([fault.finding(str(source)) for fault in faults])
    content = copy_content(document.content)
    fitted = dict(_fitted_numbers(content, section))
    used = {f"{path}@{name}" for path in fitted for name in _recording_names(content)} | fitted.keys()
    unknown = [name for name in values if name not in used]
    if unknown:
        names = sorted(used)
        raise FrictionOcpError(
            [Finding(str(source), f"'{name}' is not fitted", remedy=closest(name, names)) for name in unknown]
        )
    for path in fitted.keys() & values.keys():
        _replace_guess(fitted[path], values[path])
    rewrite_recordings(content, source, Path(folder), values)
    settle_estimation(content, max_step, horizon_s)
    return dump_document(content, document.head)


def _replace_guess(number: dict[str, Any], value: float) -> None:
    """Put a value, inside the bounds whatever rounding did to it, in place of the guess."""
    if "prior_std" in number:
        number.setdefault("prior_mean", number["guess"])
    number["guess"] = min(max(float(value), number.get("min", -math.inf)), number.get("max", math.inf))


def _fitted_numbers(content: dict[str, Any], section: ProblemSection) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield every mapping with a guess under the path of its parameter."""
    parts, drive = content["drive"], section.build_drive()
    motors = [parts["motor"]] if parts.get("motor") else parts.get("motors", [])
    named: list[tuple[str, Any]] = [
        *zip((shaft.name for shaft in drive.shafts), parts["shafts"], strict=True),
        *zip((item.name for item in drive.transmissions), parts.get("transmissions", []), strict=True),
        *zip((motor.name for motor in drive.motors), motors, strict=True),
        *content["channels"].items(),
        ("controller", content.get("controller") or parts.get("controller")),
        *((f"clocks.{name}", content["clocks"][name]) for name in section.clocks),
    ]
    for name, node in named:
        for keys, number in _with_guess(node, ()):
            yield ".".join((name, *_direction_last(keys))), number


def _with_guess(node: Any, keys: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], dict[str, Any]]]:
    if isinstance(node, dict) and "guess" in node:
        yield keys, node
    elif isinstance(node, dict):
        for key, item in cast(dict[str, Any], node).items():
            yield from _with_guess(item, (*keys, key))
    elif isinstance(node, list):
        for index, item in enumerate(cast(list[Any], node)):
            yield from _with_guess(item, (*keys, str(index)))


def _direction_last(keys: Sequence[str]) -> Sequence[str]:
    """The file may write slopes: {positive: [...]}; the parameter is slopes.0.positive."""
    if len(keys) > 1 and keys[-2] in _DIRECTIONS:
        return (*keys[:-2], keys[-1], keys[-2])
    return keys


def _recording_names(content: dict[str, Any]) -> list[str]:
    return [_name_of(_as_mapping(entry)) for entries in content["recordings"].values() for entry in entries]


def _name_of(entry: dict[str, Any]) -> str:
    """Return what results call the recording of an entry, or the piece of it."""
    return span_of(entry).named(Path(entry["file"]).stem)


def _as_mapping(entry: Any) -> dict[str, Any]:
    return {"file": entry} if isinstance(entry, str) else entry


def rewrite_recordings(content: dict[str, Any], source: Path, folder: Path, values: Mapping[str, float]) -> None:
    for kind, entries in content["recordings"].items():
        content["recordings"][kind] = [_rewritten(_as_mapping(entry), source, folder, values) for entry in entries]


def settle_estimation(content: dict[str, Any], max_step: float | None, horizon_s: float | None) -> None:
    """State the integrator step and the judging windows that belong to the values, unless the file states others."""
    used = {"max_step": max_step, "horizon_s": horizon_s}
    stated = {key: value for key, value in used.items() if value is not None}
    if stated:
        content["estimation"] = stated | (content.get("estimation") or {})


def _rewritten(entry: dict[str, Any], source: Path, folder: Path, values: Mapping[str, float]) -> Any:
    """Return an entry whose file is named from `folder`, its own values beside it."""
    name = _name_of(entry)
    own = {
        path: float(value) for key, value in values.items() for path, _, owner in [key.partition("@")] if owner == name
    }
    file = entry["file"] if Path(entry["file"]).is_absolute() else _from(folder, recording_path(source, entry["file"]))
    numbers = {**entry.get("set", {}), **own}
    ends = {key: entry[key] for key in ("from", "to") if key in entry}
    return {"file": file, **ends, **({"set": numbers} if numbers else {})} if ends or numbers else file


def _from(folder: Path, path: Path) -> str:
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive
        return str(path.resolve())

"""What is left of a faulty document, so that its other faults are found in the same run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, cast

from pydantic import ValidationError

from friction_ocp.problem_file.numbers import UNREADABLE
from friction_ocp.problem_file.schema import ProblemSection
from friction_ocp.problem_file.sections import Fault, Location, faults_of

_MOST_ROUNDS = 8


def read_section(content: Mapping[str, Any]) -> tuple[ProblemSection | None, list[Fault]]:
    """Read the content of a file by its schema; every fault is returned, none raised."""
    try:
        return ProblemSection.model_validate(dict(content)), []
    except ValidationError as error:
        return None, faults_of(error)


def salvage(content: Mapping[str, Any], faults: Iterable[Fault]) -> ProblemSection | None:
    """Take faulty numbers and keys out until the rest can be read; None where too little is left."""
    rest = copy_content(content)
    todo = list(faults)
    for _ in range(_MOST_ROUNDS):
        for fault in todo:
            if not _take_out(rest, fault):
                return None
        section, todo = read_section(rest)
        if section is not None:
            return section
    return None


def _take_out(content: dict[str, Any], fault: Fault) -> bool:
    """Mark an unreadable number, or remove a key; what a list holds cannot be removed without renaming the rest."""
    if fault.number is not None:
        return _put(content, fault.number, UNREADABLE)
    location = fault.location
    while location:
        holder = _at(content, location[:-1])
        if isinstance(holder, dict) and location[-1] in holder:
            del holder[location[-1]]
            return True
        if not isinstance(holder, dict):
            return False
        location = location[:-1]
    return False


def _put(content: dict[str, Any], location: Location, value: Any) -> bool:
    holder: Any = _at(content, location[:-1])
    if isinstance(holder, (dict, list)):
        cast(Any, holder)[location[-1]] = value
        return True
    return False


def _at(content: Any, location: Location) -> Any:
    for part in location:
        try:
            content = content[part]
        except (KeyError, IndexError, TypeError):
            return None
    return content


def copy_content(content: Mapping[str, Any]) -> dict[str, Any]:
    """Copy mappings and lists, each place its own even where the file used an alias."""
    return _copy(content)


def _copy(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _copy(item) for key, item in cast(Mapping[str, Any], value).items()}
    return [_copy(item) for item in cast(list[Any], value)] if isinstance(value, list) else value

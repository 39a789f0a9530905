"""A result made again from what it says about itself, and whether the numbers agree."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard, cast

from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.estimate import identify, simulate
from friction_ocp.estimation.problem import Problem
from friction_ocp.excitation.design import design
from friction_ocp.execution.executor import InProcess
from friction_ocp.fleet.batch import STORE, batch
from friction_ocp.output_folder import save
from friction_ocp.problem_file.load import load_problem
from friction_ocp.result_document import provenance
from friction_ocp.statistics.bootstrap import bootstrap
from friction_ocp.statistics.compare import compare
from friction_ocp.statistics.execution import Execution
from friction_ocp.statistics.multistart import multistart
from friction_ocp.statistics.profile import profile
from friction_ocp.whereabouts import problem_place, recording_places
from friction_ocp.whole_file import write_text

FORMAT = "friction-ocp-rerun/1"
TOLERANCE = 1e-3
"""Relative; of lists, relative to their largest number."""
SHARE_OF_ERROR = 0.01
"""Standard errors by which a parameter may differ all the same."""
COMPARED = (
    "status",
    "verdict",
    "parameters",
    "fit",
    "multistart",
    "profile",
    "bootstrap",
    "compare",
    "accepted",
    "alias_sets",
    "as_near",
    "gap",
    "biased_parameters",
    "machines",
    "drifts",
    "outliers",
)
"""What of a result is its answer."""
LEFT_OUT = frozenset({"seconds", "iterations", "message", "p_value", "adjusted_p_value"})
"""How the answer was reached, and what jumps where it does not matter."""
FILES = frozenset({"drifts.after", "outliers.recording"})
"""Where an answer names files, whose places may be others."""
UNDER_WAY = "rerun-under-way.txt"
"""Stands in the output folder until the work is done: the checksum of the result that is made again."""
VERSIONS = ("friction_ocp", "casadi", "numpy", "scipy", "python", "code")

Json = Mapping[str, Any]


@dataclass(frozen=True)
class Difference:
    """A number or word that is another one now."""

    where: str
    before: Any
    after: Any


@dataclass(frozen=True)
class Repetition:
    """What came of making a result again."""

    changed: tuple[str, ...]
    """Inputs that are not what they were: files, versions."""
    compared: int
    differences: tuple[Difference, ...]

    @property
    def agrees(self) -> bool:
        """Whether every number agrees within the tolerance."""
        return not self.differences


def rerun(
    result: str | Path,
    folder: str | Path,
    execution: Execution = Execution(InProcess()),
    tolerance: float = TOLERANCE,
    problem: Path | None = None,
) -> Repetition:
    """Make the result in a file or folder again, into another folder, and compare the two; rerun.json tells it.

    The problem is what the result holds; recordings are found from where the problem file lay, or from `problem` where
    it has moved. Raises FrictionOcpError where the result does not say how it was made, or a recording is gone.
    """
    source, folder = Path(result), Path(folder)
    path = source / "result.json" if source.is_dir() else source
    before = read_result(path)
    made = _provenance(before, path)
    if (folder / "result.json").exists() and (folder / "result.json").samefile(path):
        raise FrictionOcpError(Finding(str(folder), "this is where the result lies", remedy="give another --out"))
    places = [problem or _place(item, path) for item in made["problems"]]
    made = _located(made, path, places[0])
    problems = [load_problem(place, item["text"]) for place, item in zip(places, made["problems"], strict=True)]
    _begin(folder, hashlib.sha256(path.read_bytes()).hexdigest())
    _COMMANDS[made["command"]["name"]](problems, made, folder, execution)
    after = read_result(folder / "result.json")
    _forget(folder)
    pairs = list(_pairs("", _answer(before), _answer(after), tolerance))
    differences = tuple(_differences(pairs))
    changed = tuple(_changed(made, after["provenance"], places, problems))
    found = Repetition(changed, len(pairs), differences)
    _write(found, folder)
    return found


def _write(found: Repetition, folder: Path) -> None:
    """Write rerun.json beside the result that was made again."""
    content = {
        "format": FORMAT,
        "agrees": found.agrees,
        "compared": found.compared,
        "changed": list(found.changed),
        "differences": [{"where": d.where, "before": d.before, "after": d.after} for d in found.differences],
    }
    write_text(folder / "rerun.json", json.dumps(content, indent=1))


def read_result(path: Path) -> dict[str, Any]:
    """Read a result.json; raises FrictionOcpError where it is none."""
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        what, allowed = "there is no such result", "result.json, or the folder that holds it"
        raise FrictionOcpError(Finding(str(path), what, allowed, "correct the path")) from error
    except (OSError, ValueError, RecursionError) as error:
        what = f"this cannot be read as a result ({error})"
        raise FrictionOcpError(Finding(str(path), what, "result.json, or the folder that holds it")) from error
    if not isinstance(content, dict) or not str(cast("Json", content).get("format", "")).startswith("friction-ocp-"):
        raise FrictionOcpError(Finding(str(path), "this is not a result", "a result.json of this toolkit"))
    return cast("dict[str, Any]", content)


def _provenance(result: Json, path: Path) -> Json:
    made: Any = result.get("provenance")
    try:
        name, problems = made["command"]["name"], list(made["problems"])
        known = name in _COMMANDS and all(isinstance(item["text"], str) for item in problems if item is not None)
    except (TypeError, KeyError):
        known, problems = False, []
    if not known:
        what = "it does not say how it was made"
        raise FrictionOcpError(Finding(str(path), what, f"a result of {', '.join(_COMMANDS)}", "make it anew"))
    if not problems or None in problems:
        what = "its problem was made in Python, not read from a file"
        raise FrictionOcpError(Finding(str(path), what, remedy="run the script that made it"))
    return made


def _place(item: Json, result: Path) -> Path:
    return problem_place(Path(item["path"]), item.get("sha256", ""), result)


def _located(made: Json, result: Path, problem: Path) -> Json:
    """Return the provenance with the recordings of a batch, named by their paths, named by where they lie now.

    Raises FrictionOcpError where one is gone.
    """
    if made["command"]["name"] != "batch":
        return made
    before: Mapping[str, str] = made["recordings"]
    places = recording_places(before, result, Path(made["problems"][0]["path"]), problem)
    remedy = "put it there, or run the command in the folder from which the result was made"
    lost = [Finding(name, "this recording is gone", remedy=remedy) for name, at in places.items() if not at.is_file()]
    if lost:
        raise FrictionOcpError(lost)
    return {**made, "recordings": {places[name].as_posix(): digest for name, digest in before.items()}}


def _begin(folder: Path, result: str) -> None:
    """Take a folder for making a result again; go on with what an interrupted repetition of the same one has left.

    Raises FrictionOcpError where fits or tasks lie there that no repetition made: they would be lost at the end.
    """
    marker = folder / UNDER_WAY
    begun = marker.read_text(encoding="utf-8") if marker.exists() else None
    kept = [name for name in (STORE, "tasks") if (folder / name).exists()]
    if kept and begun is None:
        what = f"the work of another command lies here ({', '.join(kept)})"
        raise FrictionOcpError(Finding(str(folder), what, "a folder of its own", "give another --out"))
    if begun != result:
        _forget(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(marker, result)


def _forget(folder: Path) -> None:
    """Drop what a repetition kept so that it could go on."""
    shutil.rmtree(folder / "tasks", ignore_errors=True)
    for name in (STORE, UNDER_WAY, "rerun.json"):
        (folder / name).unlink(missing_ok=True)


def _identify(problems: Sequence[Problem], made: Json, folder: Path, execution: Execution) -> None:
    save(identify(problems[0], execution.progress), folder)


def _simulate(problems: Sequence[Problem], made: Json, folder: Path, execution: Execution) -> None:
    save(simulate(problems[0]), folder)


def _diagnose(problems: Sequence[Problem], made: Json, folder: Path, execution: Execution) -> None:
    save(diagnose(problems[0], execution=execution), folder)


def _design(problems: Sequence[Problem], made: Json, folder: Path, execution: Execution) -> None:
    options = made["command"]["options"]
    between = [(str(effect), str(place)) for effect, place in options["between"]]
    save(design(problems[0], options["criterion"], between), folder)


def _multistart(problems: Sequence[Problem], made: Json, folder: Path, execution: Execution) -> None:
    save(multistart(problems[0], made["command"]["options"]["starts"], execution), folder)


def _profile(problems: Sequence[Problem], made: Json, folder: Path, execution: Execution) -> None:
    save(profile(problems[0], made["command"]["options"]["parameters"], execution), folder)


def _bootstrap(problems: Sequence[Problem], made: Json, folder: Path, execution: Execution) -> None:
    save(bootstrap(problems[0], made["command"]["options"]["draws"], execution), folder)


def _compare(problems: Sequence[Problem], made: Json, folder: Path, execution: Execution) -> None:
    nested = [(special, general) for special, general in made["command"]["options"]["nested"]]
    save(compare(problems, nested, execution), folder)


def _batch(problems: Sequence[Problem], made: Json, folder: Path, execution: Execution) -> None:
    options = made["command"]["options"]
    files = [Path(name) for name in made["recordings"]]
    fleet = batch(problems[0], files, folder, **options, executor=execution.executor, watch=execution.watch)
    save(fleet, folder)


_COMMANDS: Mapping[str, Callable[[Sequence[Problem], Json, Path, Execution], None]] = {
    "simulate": _simulate,
    "identify": _identify,
    "multistart": _multistart,
    "profile": _profile,
    "bootstrap": _bootstrap,
    "compare": _compare,
    "diagnose": _diagnose,
    "design": _design,
    "batch": _batch,
}


def _changed(before: Json, after: Json, places: Sequence[Path], problems: Sequence[Problem]) -> Iterator[str]:
    """Say what is not as it was when the result was made."""
    for place, item in zip(places, before["problems"], strict=True):
        if not place.exists():
            yield f"{place} is gone; the copy in the result was used"
        elif hashlib.sha256(place.read_bytes()).hexdigest() != item["sha256"]:
            yield f"{place} is another file now; the copy in the result was used"
    for name, digest in before["recordings"].items():
        found = after["recordings"].get(name)
        if found != digest:
            yield f"recording {name} is another file now" if found else f"recording {name} took no part"
    for name in VERSIONS:
        if before.get(name) != after.get(name):
            what = "the code of friction-ocp" if name == "code" else name.replace("_", "-")
            yield f"{what} was {str(before.get(name))[:12]}, is {str(after.get(name))[:12]}"
    if before.get("model") != provenance(problems[0], "")["model"]:
        yield "the problem had been changed in Python after its file was read"


def _answer(result: Json) -> dict[str, Any]:
    return {key: result[key] for key in COMPARED if key in result}


def _pairs(where: str, before: Any, after: Any, tolerance: float) -> Iterator[tuple[str, Any, Any, float]]:
    """Yield place, both values and the difference that numbers may have, of everything that either has."""
    if isinstance(before, dict) and isinstance(after, dict):
        ours, theirs = cast("Json", before), cast("Json", after)
        slack = _slack(ours)
        for key in dict.fromkeys((*ours, *theirs)):
            place = f"{where}.{key}" if where else key
            if key in LEFT_OUT or re.sub(r"\[\d+\]", "", place) in FILES:
                continue
            for name, one, other, allowed in _pairs(place, ours.get(key), theirs.get(key), tolerance):
                yield name, one, other, max(allowed, slack if key in ("value", "interval95") else 0.0)
    elif isinstance(before, list) and isinstance(after, list) and len(cast("Any", before)) == len(cast("Any", after)):
        pairs = list(zip(cast("list[Any]", before), cast("list[Any]", after), strict=True))
        largest = max((abs(v) for pair in pairs for v in pair if _is_number(v)), default=0.0)
        for index, (one, other) in enumerate(pairs):
            for name, a, b, allowed in _pairs(f"{where}[{index}]", one, other, tolerance):
                yield name, a, b, max(allowed, tolerance * largest)
    else:
        both = cast("tuple[Any, Any]", (before, after))
        yield where, *both, tolerance * max((abs(value) for value in both if _is_number(value)), default=0.0)


def _slack(content: Json) -> float:
    """Return the share of its standard error by which an estimate may differ."""
    std_error = content.get("std_error")
    return SHARE_OF_ERROR * float(std_error) if _is_number(std_error) else 0.0


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _differences(pairs: Sequence[tuple[str, Any, Any, float]]) -> Iterator[Difference]:
    for where, before, after, allowed in pairs:
        if _is_number(before) and _is_number(after):
            if abs(before - after) > allowed:
                yield Difference(where, before, after)
        elif before != after:
            yield Difference(where, before, after)

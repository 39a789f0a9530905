"""Whether tests run every problem file, and whether one command makes the gallery as it is."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import watched_tests
from checks import Check
from servo import all_of
from watched_tests import EXPECTED, LEFT_OUT, PROBLEMS, Ran

sys.path.append(str(PROBLEMS))

import gallery

TESTS = (
    "tests/problems/test_lto.py",
    "tests/problems/test_aries.py",
    "tests/problems/test_two_mass.py",
    "tests/problems/test_xl330.py",
    "tests/benchmarks/test_emps.py",
)
"""Where the problem files are run."""
ROW = re.compile(r"^\| `(.+?)` \| (\S+) \| (\S+) \| (.+?) \| (\S+) \|$", re.MULTILINE)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
ERRORS_REPEATED = 0.05
"""By how much the errors in the sentence of a simulation may differ, relative: they have two digits."""


@dataclass(frozen=True)
class Answer:
    """A row of a table of the page; the error is NaN where the page has none."""

    value: float
    std_error: float
    verdict: str


def run_by_tests(quick: bool) -> Check:
    """Which problem files are identified or simulated, as they stand, by a test."""
    results = watched_tests.results_of(TESTS, quick)
    return files_run(watched_tests.problem_files(), results, quick)


def files_run(files: Sequence[str], results: Mapping[str, Ran], quick: bool) -> Check:
    """Judge what tests did: every file has one that ran it and passed, and none failed, known to or not."""
    runs = {name: [ran for ran in results.values() if name in ran.files] for name in files}
    missing = [name for name, own in runs.items() if not any(ran.outcome == "passed" for ran in own)]
    known = [node for node, ran in results.items() if ran.outcome == EXPECTED]
    failed = [node for node, ran in results.items() if ran.outcome == "failed"]
    slow = sum(ran.outcome == LEFT_OUT for ran in results.values())
    skipped = sum(ran.outcome == "skipped" for ran in results.values())
    told = f"{len(files) - len(missing)} of {len(files)} files, by {len(results)} tests"
    told += f", {skipped} skipped" if skipped else ""
    told += f", {slow} slow left out" if slow else ""
    told += f"; run by none: {', '.join(missing)}" if missing else ""
    told += f"; known to fail: {', '.join(known)}" if known else ""
    told += f"; failed: {', '.join(failed)}" if failed else ""
    return Check("run by tests", told, not failed and not known and (quick or not missing))


def answers_of(section: str) -> dict[str, Answer]:
    """Return the table of a section by parameter."""
    return {
        name: Answer(_number(value), _number(error), verdict) for name, value, error, _, verdict in ROW.findall(section)
    }


def _number(text: str) -> float:
    return float("nan") if text == "-" else float(text)


def differences(committed: Mapping[str, str], made: Mapping[str, str]) -> list[str]:
    """Return where sections of two pages differ by more than a printed standard error."""
    found = [f"{title}: only on the committed page" for title in committed if title not in made]
    found += [f"{title}: not on the committed page" for title in made if title not in committed]
    for title in (title for title in committed if title in made):
        old, new = answers_of(committed[title]), answers_of(made[title])
        found += [f"{title}: its opening differs"] * (opening(committed[title]) != opening(made[title]))
        ends = [verdict_of(page[title]) for page in (committed, made)]
        if ends[0] != ends[1]:
            found.append(f"{title}: was {ends[0]}, is {ends[1]}")
        if old.keys() != new.keys():
            found.append(f"{title}: other parameters")
        elif old:
            found += [f"{title}: {text}" for name in old if (text := moved(name, old[name], new[name]))]
        elif not same_sentence(committed[title], made[title]):
            found.append(f"{title}: {committed[title].splitlines()[-1]} Now: {made[title].splitlines()[-1]}")
    return found


def opening(section: str) -> str:
    """Return title, question and picture of a section."""
    return "\n\n".join(section.split("\n\n")[:3])


def verdict_of(section: str) -> str:
    """Return how the fit of a section ended, without what follows; empty where there was none."""
    found = re.search(r"^(Converged|Not converged)\b", section, re.MULTILINE)
    return found.group().lower() if found else ""


def moved(name: str, old: Answer, new: Answer) -> str:
    """Return how an answer moved; empty where it is within the standard error and called the same.

    Where none is printed, at a bound, the verdict alone is compared.
    """
    if old.verdict != new.verdict:
        return f"{name} was {old.verdict}, is {new.verdict}"
    if abs(new.value - old.value) > old.std_error:
        return f"{name} was {old.value:g} +- {old.std_error:g}, is {new.value:g}"
    return ""


def same_sentence(old: str, new: str) -> bool:
    """Whether two sections without a table have the same words, and numbers that differ by little."""
    if NUMBER.sub("#", old) != NUMBER.sub("#", new):
        return False
    pairs = zip(NUMBER.findall(old), NUMBER.findall(new), strict=True)
    return all(abs(float(b) - float(a)) <= ERRORS_REPEATED * abs(float(a)) for a, b in pairs)


def regenerated(only: str = "") -> Check:
    """Make the page again in another folder and compare it with the committed one."""
    with tempfile.TemporaryDirectory() as scratch:
        began = time.perf_counter()
        command = [sys.executable, str(PROBLEMS / "gallery.py"), "--out", scratch, "--only", only]
        run = subprocess.run(command, cwd=watched_tests.ROOT, capture_output=True, text=True)
        seconds = time.perf_counter() - began
        if run.returncode != 0:
            return Check("regenerated by one command", f"{run.stderr.strip()[-500:]}", False)
        made = gallery.sections_of((Path(scratch) / gallery.PAGE.name).read_text(encoding="utf-8"))
        drawn = {path.name for path in (Path(scratch) / gallery.PICTURES.name).glob("*.png")}
    committed = gallery.sections_of(gallery.PAGE.read_text(encoding="utf-8"))
    committed = {title: text for title, text in committed.items() if only in f"{title}.yaml"}
    found = differences(committed, made)
    shown = set(re.findall(r"\(gallery/(.+?\.png)\)", "".join(committed.values())))
    found += [f"picture {name} is only in one of them" for name in sorted(shown ^ drawn)]
    told = [f"{len(made)} sections and {len(drawn)} pictures in {seconds:.0f} s, {len(found)} differences", *found]
    return Check("regenerated by one command, answers within their standard errors", "\n".join(told), not found)


def looked_at() -> Check:
    """Return the part that only a person can judge."""
    count = len(list(gallery.PICTURES.glob("*.png")))
    return Check("each picture was looked at", f"{count} in problems/gallery", None, by_eye=True)


def gallery_line(line: str, quick: bool) -> Check:
    """Files that tests run, the page made again, and the pictures."""
    return all_of(line, [run_by_tests(quick), regenerated("lto/curve" if quick else ""), looked_at()])

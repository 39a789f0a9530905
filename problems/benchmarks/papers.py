"""Every equation, table and figure of the two telescope papers: its problem files, and the tests that check it.

The list is papers.yaml: by paper the items, each with the problem files that ask for it, where it is an experiment and
not a law or a reduction, and the node IDs of its tests. An item holds where its files load without an error, every one
of its tests is there and passes, and each file is identified or simulated, as it stands, by one of these tests.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import watched_tests
import yaml
from checks import Check
from watched_tests import LEFT_OUT, Ran

from friction_ocp.errors import FrictionOcpError
from friction_ocp.problem_file.load import load_problem

LIST = Path(__file__).with_name("papers.yaml")


@dataclass(frozen=True)
class Item:
    """An equation, a table or a figure."""

    paper: str
    what: str
    files: tuple[str, ...]
    """Below `problems`."""
    tests: tuple[str, ...]


def items(text: str) -> list[Item]:
    """Return what a list in YAML names, in its order."""
    return [
        Item(paper, entry["item"], tuple(entry.get("problems", ())), tuple(entry.get("tests", ())))
        for paper, entries in yaml.safe_load(text).items()
        for entry in entries
    ]


def faults_of(item: Item, results: Mapping[str, Ran]) -> list[str]:
    """Return what is missing or wrong, whatever the tests say."""
    faults = [fault for fault in map(file_fault, item.files) if fault]
    unknown = [test for test in item.tests if not any(watched_tests.covers(test, node) for node in results)]
    faults += [f"no such test: {test}" for test in unknown]
    if not item.tests:
        faults.append("no test")
    own = own_results(item, results)
    run = {name for ran in own.values() for name in ran.files}
    if not any(ran.outcome == LEFT_OUT for ran in own.values()):
        faults += [f"{name} is run by none of them" for name in item.files if name not in run]
    return faults


def file_fault(name: str) -> str:
    """Return why a problem file does not load; empty where it does."""
    path = watched_tests.PROBLEMS / name
    if not path.is_file():
        return f"problems/{name} does not exist"
    try:
        load_problem(path)
    except FrictionOcpError as error:
        return f"problems/{name} does not load: {error}"
    return ""


def own_results(item: Item, results: Mapping[str, Ran]) -> dict[str, Ran]:
    """Return what became of the tests of an item, parameters one by one."""
    return {node: ran for node, ran in results.items() if any(watched_tests.covers(test, node) for test in item.tests)}


def judged(item: Item, results: Mapping[str, Ran]) -> tuple[str, bool]:
    """Return the row of an item, and whether it holds; slow tests that were left out are told, not held against it."""
    own = own_results(item, results)
    left_out = sum(ran.outcome == LEFT_OUT for ran in own.values())
    passed = sum(ran.outcome == "passed" for ran in own.values())
    faults = faults_of(item, results)
    row = f"{item.paper}: {item.what}: {', '.join(item.files) or 'no problem file'}: {passed} of {len(own)} tests pass"
    row += f", {left_out} slow left out" if left_out else ""
    return "; ".join([row, *faults]), not faults and passed + left_out == len(own)


def check(line: str, listed: Sequence[Item], quick: bool) -> Check:
    """Run the tests of all items at once and return one row an item."""
    results = watched_tests.results_of(dict.fromkeys(test for item in listed for test in item.tests), quick)
    rows = [judged(item, results) for item in listed]
    held = sum(holds for _, holds in rows)
    seconds = sum(ran.seconds for ran in results.values())
    told = f"{held} of {len(rows)} items hold, {len(results)} tests in {seconds:.0f} s"
    return Check(line, "\n".join([*(row for row, _ in rows), told]), held == len(rows))


def papers(line: str, quick: bool) -> Check:
    """Every item of papers.yaml."""
    return check(line, items(LIST.read_text(encoding="utf-8")), quick)

"""The list of what the papers have, what a watched run of the tests tells, and the two pages of the gallery."""

from __future__ import annotations

from dataclasses import replace

import papers
import problem_files
import pytest
import watched_tests
from papers import Item
from watched_tests import EXPECTED, LEFT_OUT, Ran

CURVE = "tests/problems/test_lto.py::test_the_curve_is_the_polyline_of_equation_6"
SOUND = "tests/problems/test_lto.py::test_every_problem_file_is_sound_and_opens_with_its_question[curve]"
SLOW = "tests/problems/test_lto.py::test_draws_are_told_apart"
ITEM = Item("paper", "figure", ("lto/curve.yaml",), ("t.py::a", "t.py::b[1]"))
RESULTS = {
    "t.py::a[x]": Ran(files=["lto/curve.yaml"]),
    "t.py::a[y]": Ran(),
    "t.py::b[1]": Ran(),
    "t.py::b[2]": Ran("failed"),
}


def test_the_list_names_each_item_once_with_its_tests() -> None:
    """Both papers are there, every item has a test, and every problem file of both telescopes is in its folder."""
    listed = papers.items(papers.LIST.read_text(encoding="utf-8"))
    assert {item.paper for item in listed} == {"LTO", "ARIES"}
    assert len({item.what for item in listed}) == len(listed) and all(item.tests for item in listed)
    assert {name for item in listed for name in item.files} <= set(watched_tests.problem_files())


def test_an_item_holds_where_all_of_its_tests_pass() -> None:
    """Parameters count one by one; those that were not asked for do not count."""
    row, holds = papers.judged(ITEM, RESULTS)
    assert holds and "lto/curve.yaml: 3 of 3 tests pass" in row


@pytest.mark.parametrize(
    ("item", "results", "said"),
    [
        (ITEM, RESULTS | {"t.py::a[y]": Ran("failed")}, "2 of 3 tests pass"),
        (ITEM, RESULTS | {"t.py::a[y]": Ran("skipped")}, "2 of 3 tests pass"),
        (ITEM, RESULTS | {"t.py::a[y]": Ran(EXPECTED)}, "2 of 3 tests pass"),
        (replace(ITEM, tests=("t.py::a", "t.py::c")), RESULTS, "no such test: t.py::c"),
        (replace(ITEM, files=(), tests=()), RESULTS, "no test"),
        (replace(ITEM, tests=("t.py::b[1]",)), RESULTS, "lto/curve.yaml is run by none of them"),
        (replace(ITEM, files=("lto/none.yaml",)), RESULTS, "problems/lto/none.yaml does not exist"),
    ],
)
def test_an_item_with_a_fault_does_not_hold(item: Item, results: dict[str, Ran], said: str) -> None:
    """A failing, skipped, unknown or missing test, and a file that is not there or not run, are told."""
    row, holds = papers.judged(item, results)
    assert not holds and said in row


def test_slow_tests_that_were_left_out_are_told() -> None:
    """They are not held against an item, and neither is the file that they would have run."""
    row, holds = papers.judged(ITEM, RESULTS | {"t.py::a[x]": Ran(LEFT_OUT)})
    assert holds and "2 of 3 tests pass, 1 slow left out" in row


def test_a_watched_run_tells_outcomes_and_files() -> None:
    """A test that fits a file counts for it, one that checks it does not; slow and unknown tests are told apart."""
    results = watched_tests.results_of([CURVE, SOUND, SLOW, f"{CURVE}_of_none", "tests/none.py::test"], quick=True)
    assert {node: (ran.outcome, ran.files) for node, ran in results.items()} == {
        CURVE: ("passed", ["lto/curve.yaml"]),
        SOUND: ("passed", []),
        SLOW: (LEFT_OUT, []),
    }


def test_a_file_that_no_test_runs_is_told() -> None:
    """Unless slow tests were left out that may run it; a test that fails is told, too."""
    files = ["lto/curve.yaml", "lto/joint.yaml"]
    missing = problem_files.files_run(files, {"t.py::a": RESULTS["t.py::a[x]"]}, quick=False)
    assert not missing.passed and "run by none: lto/joint.yaml" in missing.measured
    assert problem_files.files_run(files, {"t.py::a": RESULTS["t.py::a[x]"]}, quick=True).passed
    failed = problem_files.files_run(files[:1], RESULTS, quick=False)
    assert not failed.passed and "failed: t.py::b[2]" in failed.measured
    assert problem_files.files_run(files[:1], {"t.py::a": RESULTS["t.py::a[x]"]}, quick=False).passed
    known = problem_files.files_run(files[:1], {"t.py::a": Ran(EXPECTED, files=files[:1])}, quick=False)
    assert not known.passed and "known to fail: t.py::a" in known.measured


SECTION = """## a/b

[a/b.yaml](a/b.yaml): What?

![b](gallery/a-b.png)

Converged.

| parameter | value | standard error | unit | verdict |
|---|---|---|---|---|
| `x.tau_c` | 1.5 | 0.1 | N m | ok |
| `x.tau_s` | 0 | - | N m | at_bound |
"""
SIMULATED = """## a/c

[a/c.yaml](a/c.yaml): Does it?

![c](gallery/a-c.png)

With these numbers the free run repeats position to 1.2e-05 rad rms (0.5% of its motion).
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("1.5 |", "1.59 |", ""),
        ("1.5 |", "1.61 |", "x.tau_c was 1.5 +- 0.1, is 1.61"),
        ("1.5 | 0.1 | N m | ok", "1.5 | 0.1 | N m | traded", "x.tau_c was ok, is traded"),
        ("`x.tau_s`", "`x.omega_s`", "other parameters"),
        ("Converged.", "Not converged: why.", "a/b: was converged, is not converged"),
        ("What?", "Why?", "its opening differs"),
        ("1.2e-05", "1.22e-05", ""),
        ("1.2e-05", "1.4e-05", "1.2e-05 rad rms"),
        ("## a/c", "## a/d", "only on the committed page"),
    ],
)
def test_pages_differ_beyond_the_standard_error(old: str, new: str, said: str) -> None:
    """Answers within it are the same; verdicts, questions, sections and parameters have to be."""
    page = SECTION + "\n" + SIMULATED
    sections = (problem_files.gallery.sections_of(text) for text in (page, page.replace(old, new)))
    found = problem_files.differences(*sections)
    assert said in "; ".join(found) and bool(found) == bool(said)


@pytest.mark.slow
def test_the_gallery_is_made_in_another_folder() -> None:
    """One section of the committed page again, with its picture and the same answer."""
    check = problem_files.regenerated("lto/curve")
    assert check.passed, check.measured
    assert check.measured.startswith("1 sections and 1 pictures")

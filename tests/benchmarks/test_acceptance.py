"""The lines of every piece of work are told, and honestly."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import acceptance
import diagnosis
import pytest
import servo
from checks import Check, status

README = """
```sh
# a comment
$ mkdir -p results/servo-identify && touch results/servo-identify/report.html

python -c "import sys; sys.exit('/venv/' not in sys.executable)"
```

```python
print("not a command")
```
"""


@pytest.mark.parametrize("name", ["servo", "engine", "telescopes", "users"])
def test_every_line_has_its_measurement(name: str) -> None:
    """IDs of lines and measurements are the same."""
    assert acceptance.lines()[name].keys() == acceptance.MEASURES[name].keys()


def test_every_line_of_the_diagnosis_has_its_measurement() -> None:
    """IDs of lines and measurements are the same."""
    assert list(acceptance.lines()["diagnosis"]) == list(diagnosis.MEASURES)


def test_a_score_of_few_cases_is_no_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blind suite's line shows what was scored, and holds only with a report of enough cases."""
    lines = [{"what": "cause right", "measured": "9 of 10", "passed": True}]
    for title, counts, held in (("seed 5 (development)", (100, 60), False), ("seed 20261121 (report)", (99, 60), False),
                                ("seed 20261121 (report)", (100, 60), True)):  # fmt: skip
        cases = [{"kind": kind} for kind, count in zip(("one", "none"), counts, strict=True) for _ in range(count)]
        (tmp_path / "score.json").write_text(json.dumps({"title": title, "lines": lines, "cases": cases}))
        monkeypatch.setenv(diagnosis.BLIND, str(tmp_path))
        check = diagnosis.blind_suite("line", quick=False)
        assert check.passed is held and "cause right: 9 of 10" in check.measured


def test_lines_without_measurement_fail(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Such a line is printed as not measured, and the exit status is 1."""
    monkeypatch.setattr(acceptance, "MEASURES", {})
    assert acceptance.main(["telescopes", "--only", "papers"]) == 1
    text = capsys.readouterr().out
    assert text.count("not measured yet") == 1
    assert "0 of 1 lines hold" in text


def test_no_line_is_chosen_by_an_unknown_id() -> None:
    """Choosing nothing is no success."""
    assert acceptance.main(["servo", "--only", "no such line"]) == 1


@pytest.mark.parametrize(
    ("check", "word", "expected"),
    [
        (Check("a", "1", True), "ok", 0),
        (Check("a", "1", False), "NO", 1),
        (Check("a", "", None), "not measured", 1),
        (Check("a", "", None, by_eye=True), "by eye", 0),
    ],
)
def test_verdicts_decide_the_exit_status(check: Check, word: str, expected: int) -> None:
    """Only what holds, or what a person judges, is no failure."""
    assert check.verdict == word
    assert status([Check("b", "", True), check]) == expected


def test_commands_of_a_readme_are_its_shell_lines() -> None:
    """Prompts and comments are no commands, and Python is none."""
    first, second = servo.readme_commands(README)
    assert first.startswith("mkdir -p results") and second.startswith("python -c")


def test_what_a_person_judges_does_not_decide() -> None:
    """A line of parts holds where those hold that are measured; one that only a person can judge is told beside."""
    eye = Check("looked at", "3 pictures", None, by_eye=True)
    assert servo.all_of("line", [Check("a", "1", True), eye]).passed
    assert not servo.all_of("line", [Check("a", "1", False), eye]).passed
    assert not servo.all_of("line", [Check("a", "1", None), eye]).passed
    assert "by eye: looked at: 3 pictures" in servo.all_of("line", [eye]).measured


def test_bad_input_needs_at_least_one_test() -> None:
    """A kind without a test fails, and so does one with a failing test."""
    results = [("t.py::a[x]", "PASSED"), ("t.py::a[y]", "FAILED")]
    assert [servo.bad_input_check("kind", part, results).passed for part in ("[x]", "[y]", "[z]")] == [
        True,
        False,
        False,
    ]


@pytest.mark.slow
def test_readme_is_followed_in_a_fresh_clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both commands run in the clone, inside the new environment."""
    (tmp_path / "README.md").write_text(README)
    identity = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
    for arguments in (["init", "--quiet"], ["add", "."], [*identity, "commit", "--quiet", "-m", "README"]):
        subprocess.run(["git", *arguments], cwd=tmp_path, check=True)
    monkeypatch.setattr(servo, "ROOT", tmp_path)
    check = servo.follow_readme("line", quick=False)
    assert check.passed, check.measured
    assert "results/servo-identify/report.html" in check.measured

"""Score `friction-ocp diagnose` on blind cases.

python problems/blind/score.py --seed N [--cases M] [--out DIR] [--baselines all|correlation|none]
    [--workers W] [--jobs J]

Makes the cases of a seed, diagnoses each through the command line, opens the answers, and prints the table; DIR gets
score.json and confusion.png. What is on disk is not done again: a score that was stopped goes on at the case where it
stood, and --cases can grow. Times of --jobs 2 are those of diagnoses that shared the machine; one that took too long is
run again by itself, in as many processes, and that time counts.

Seeds. 1 to 999 are for development: their cases may be looked into, and what was changed for them makes them worthless
as evidence. A report takes the date on which the code was frozen as its seed, YYYYMMDD, and is run once; any other seed
is refused.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from datetime import date
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind.baselines import CHOICES, baselines_right
from blind.cases import Case, read_answer
from blind.draw import make
from blind.folder import write_json
from blind.judging import Judged, Named, judge, named
from blind.outside import OUTSIDE
from blind.picture import draw_confusion
from blind.running import TIME_LIMIT, Failed, confirmed, diagnosed, fitted_base, reached
from blind.summary import LONGEST, Checked, Line, confusion, summary

DEVELOPMENT = range(1, 1000)
NOTHING = Named("failed", (), (), (), {}, None, TIME_LIMIT, None)
"""A diagnosis without a result: wrong, whatever was asked."""


def purpose(seed: int) -> str:
    """Return what a seed is for; raises ValueError for one that is for nothing."""
    if seed in DEVELOPMENT:
        return "development"
    try:
        date.fromisoformat(str(seed))
    except ValueError:
        raise ValueError(f"--seed: {seed}; 1 to 999 for development, a date YYYYMMDD for a report") from None
    return "report"


def score_case(case: Case, folder: Path, baselines: Sequence[str], workers: int = 2) -> tuple[Judged, Checked]:
    """Diagnose a case and check what its answer promises; raises Failed."""
    problem = folder / "cases" / case.name / "problem.yaml"
    result, seconds = diagnosed(problem, folder / "diagnoses" / case.name, workers)
    judged = judge(read_answer(folder, case.name), named(result, seconds))
    memory = folder / "checks" / f"{case.name}.json"
    known = json.loads(memory.read_text(encoding="utf-8")) if memory.exists() else {}
    if "reached" not in known:
        known |= _checked(case, result, problem, folder)
    missing = [name for name in baselines if name not in known["baselines"]]
    if missing and judged.kind in ("none", "one"):
        base = fitted_base(problem, folder / "diagnoses" / case.name, folder / "bases" / case.name)
        known["baselines"] |= baselines_right(missing, base, problem, read_answer(folder, case.name))
    write_json(memory, known)
    return judged, Checked(known["reached"], tuple(known["confirmed"]), known["baselines"])


def scored(
    case: Case, folder: Path, baselines: Sequence[str], workers: int
) -> tuple[Judged, Checked | None, str | None]:
    """Return what `score_case` finds, or the judgement of no answer and what the diagnosis complained of."""
    try:
        return *score_case(case, folder, baselines, workers), None
    except Failed as error:
        return judge(read_answer(folder, case.name), NOTHING), None, str(error)


def timed_alone(row: Judged, folder: Path, workers: int) -> Judged:
    """Return a judgement with the time of the diagnosis that has the machine to itself; as it was where that fails."""
    problem = folder / "cases" / row.case / "problem.yaml"
    try:
        _, seconds = diagnosed(problem, folder / "alone" / row.case, workers)
    except Failed:
        return row
    print(f"{row.case}  alone  {seconds:5.0f} s", flush=True)
    return replace(row, seconds=seconds)


def _checked(case: Case, result: dict[str, Any], problem: Path, folder: Path) -> dict[str, Any]:
    """Return the shrinkage on fresh recordings and the confirmation of every rival in an alias set."""
    diagnosis, said = folder / "diagnoses" / case.name, named(result, 0.0)
    gained = None
    if said.accepted:
        base = fitted_base(problem, diagnosis, folder / "bases" / case.name)
        gained = reached(case, result, base, diagnosis / "augmented.yaml", folder / "fresh" / case.name)
    marks: list[bool] = []
    for members in said.alias_sets:
        leader = next((item for item in said.accepted if item in members), sorted(members)[0])
        for rival in sorted(members - {leader}):
            marks.append(confirmed(case, problem, said.accepted, rival, leader, folder / "quiet" / case.name))
    return {"reached": gained, "confirmed": marks, "baselines": {}}


def main() -> int:
    """Print a line a case and the table; exit 1 where a line of the table fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--cases", type=int, default=168)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--baselines", choices=list(CHOICES), default="all")
    parser.add_argument("--workers", type=int, default=2, help="processes of a diagnosis")
    parser.add_argument("--jobs", type=int, default=1, help="cases side by side")
    options = parser.parse_args()
    try:
        what = purpose(options.seed)
    except ValueError as error:
        parser.error(str(error))
    folder: Path = options.out or Path("results") / f"blind-{options.seed}"
    judged: list[Judged] = []
    checked: dict[str, Checked] = {}
    failed = 0
    cases = [make(options.seed, index, folder) for index in range(options.cases)]
    score = partial(scored, folder=folder, baselines=CHOICES[options.baselines], workers=options.workers)
    with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
        for case, (row, check, complaint) in zip(cases, pool.map(score, cases), strict=True):
            if complaint is not None:
                failed += 1
                print(f"{case.name}  failed: {complaint}", flush=True)
            if check is not None:
                checked[case.name] = check
            judged.append(row)
            print(f"{case.name}  {'right' if row.right else 'WRONG':<6} {row.seconds:5.0f} s", flush=True)
    title = f"seed {options.seed} ({what}), {len(judged)} cases"
    title += f", {options.workers} processes, {options.jobs} side by side"
    slow = [row.case for row in judged if options.jobs > 1 and row.seconds > LONGEST]
    if slow:
        processes = options.workers * options.jobs
        judged = [timed_alone(row, folder, processes) if row.case in slow else row for row in judged]
        title += f", {len(slow)} slow ones again alone in {processes}"
    lines = summary(judged, checked, failed)
    report(judged, lines, folder, title)
    return int(any(line.passed is False for line in lines))


def report(judged: list[Judged], lines: list[Line], folder: Path, title: str) -> None:
    """Print the table, and leave it with every judged case and the picture in the folder."""
    print(f"\n{title}")
    for line in lines:
        word = {True: "ok", False: "NO", None: ""}[line.passed]
        print(f"{word:<3} {line.what}: {line.measured}")
    write_json(folder / "score.json", {"title": title, "lines": [asdict(x) for x in lines],
                                       "cases": [asdict(x) for x in judged]})  # fmt: skip
    if judged:
        draw_confusion(*confusion(judged), set(OUTSIDE), folder / "confusion.png")


if __name__ == "__main__":
    raise SystemExit(main())

"""Make problems/README.md: every problem with its question, its picture and its answer.

python problems/gallery.py [--only TEXT] [--out FOLDER]

Each problem file is identified, or simulated where every number is known, and its section written as soon as it is
done; `--only` renews the problems whose path contains the text and keeps the other sections. Pictures go to
problems/gallery. A problem whose recordings are not there (problems/emps needs a download) keeps its question alone.
`--out` writes page and pictures into another folder.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.estimate import Estimate, Simulation, identify, simulate
from friction_ocp.estimation.score import FreeRun
from friction_ocp.estimation.static_points import StaticFit
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.static_points import StaticPoints
from friction_ocp.report.sentence import verdict_sentence
from friction_ocp.result_document import estimate_document

HERE = Path(__file__).resolve().parent
PAGE, PICTURES = HERE / "README.md", HERE / "gallery"
OPENING = """# Problems

Each file asks one question and says what is known. `python problems/gallery.py` makes this page: it identifies every
problem, or simulates it where every number is known, and draws the measurement (grey) beside the simulation (blue).
"""
Line = tuple[str, np.ndarray, np.ndarray, np.ndarray]
"""Name, abscissa, measured and predicted values."""
SAMPLES = 4000
"""Points of a curve in a picture."""


def problem_files() -> list[Path]:
    """Return all problem files, by folder and name."""
    files = HERE.glob("*/*.yaml")
    return sorted(path for path in files if path.read_text(encoding="utf-8").find("friction-ocp-problem/1") >= 0)


def question_of(path: Path) -> str:
    """Return the first paragraph of the comment that a problem file opens with, without its first word."""
    lines: list[str] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        text = line.removeprefix("#").strip()
        if not line.startswith("#") or not text:
            break
        lines.append(text)
    question = " ".join(lines).removeprefix("Asked:").strip()
    return question[:1].upper() + question[1:]


def section(path: Path, out: Path = HERE) -> str:
    """Return the section of a problem; draws its picture below the folder of the page."""
    place = path.relative_to(HERE)
    head = f"## {place.parent.name}/{place.stem}\n\n[{place}]({place}): {question_of(path)}\n"
    try:
        problem = load_problem(path)
    except FrictionOcpError:
        return f"{head}\nIts recordings have to be downloaded first (problems/{place.parent}).\n"
    known = not identify_needed(path)
    answered = simulate(problem) if known else identify(problem)
    picture = out / PICTURES.name / f"{place.parent.name}-{place.stem}.png"
    draw(answered if isinstance(answered, Simulation) else answered.simulation, answered, picture)
    told = simulation_words(answered) if isinstance(answered, Simulation) else estimate_words(answered)
    return f"{head}\n![{problem.title}]({picture.relative_to(out)})\n\n{told}\n"


def identify_needed(path: Path) -> bool:
    """Whether anything in a problem file is to be found."""
    return re.search(r"\bguess\s*:", path.read_text(encoding="utf-8")) is not None


def estimate_words(estimate: Estimate) -> str:
    """Return what an identification found: a sentence and a table."""
    rows = [
        f"| `{item.name}` | {_plain(item.value)} | {_plain(item.std_error, 2)} | {item.unit} | {item.verdict.word} |"
        for item in estimate.parameters
    ]
    table = ["| parameter | value | standard error | unit | verdict |", "|---|---|---|---|---|", *rows]
    sentences = [
        verdict_sentence(estimate_document(estimate)),
        *(_static_words(fit) for fit in estimate.simulation.static),
    ]
    return " ".join(text for text in sentences if text) + "\n\n" + "\n".join(table)


def simulation_words(simulation: Simulation) -> str:
    """Return how far a simulation with known numbers is from the measurement."""
    told = [
        f"{name} to {_plain(errors.rms, 2)} {simulation.units[name]} rms ({errors.relative:.1%} of its motion)"
        for name, (errors, _) in simulation.train_errors.items()
    ]
    return f"With these numbers the free run repeats {' and '.join(told)}."


def _static_words(fit: StaticFit) -> str:
    return f"Static points {fit.name}: missed by {_plain(fit.noise_ratio, 2)} standard errors (rms)."


def _plain(value: float, digits: int = 5) -> str:
    return f"{value:.{digits}g}" if np.isfinite(value) else "-"


def draw(simulation: Simulation, answered: Estimate | Simulation, path: Path) -> None:
    """Draw static points, the first training recording, and the friction."""
    fits = [fit for fit in simulation.static if fit.split == "train"]
    points = list(zip(fits, (use.points for use in simulation.problem.static), strict=True))
    runs = simulation.train[:1]
    curves = answered.curves if isinstance(answered, Estimate) and not points else ()
    panels = len(runs) + bool(points) + bool(curves)
    figure, axes = plt.subplots(1, panels, figsize=(4.2 * panels + 1.0, 3.0), squeeze=False)
    free = iter(axes[0])
    if points:
        _draw_points(next(free), points)
    for run in runs:
        _draw_run(next(free), run, simulation.units)
    if curves:
        panel = next(free)
        for shaft in dict.fromkeys(curve.shaft for curve in curves):
            curve = next(item for item in curves if item.shaft == shaft)
            panel.plot(curve.speed, curve.torque, label=shaft)
            panel.fill_between(curve.speed, curve.lower, curve.upper, alpha=0.2)
        panel.set(xlabel="speed, rad/s or m/s", ylabel="friction, N m or N", title="steady friction")
        panel.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    plt.close(figure)


def _draw_points(panel: Axes, sets: Sequence[tuple[StaticFit, StaticPoints]]) -> None:
    """Draw static points over speed, over position where they have places, over their set where nothing moves."""
    first, points = sets[0]
    if not np.any(first.speed):
        where, lines = "", _lines_over_sets(sets)
        panel.set_xticks(range(len(sets)), [fit.name for fit, _ in sets])
    elif points.position is None:
        where, lines = "speed, rad/s", [(fit.name, fit.speed, fit.measured, fit.predicted) for fit, _ in sets]
    else:
        where, lines = "position, rad", _lines_over_position(first, points.position)
    for number, (name, at, measured, predicted) in enumerate(lines):
        order = np.argsort(at)
        panel.plot(at[order], measured[order], "o", color="tab:gray", ms=4, label="" if number else "measured")
        label = "model" if len(lines) == 1 else f"model, {name}"
        panel.plot(at[order], predicted[order], color=f"C{number}", label=label)
    panel.set(xlabel=where, ylabel=f"{first.effort}, {first.unit}", title="at constant speed" if where else "breakaway")
    panel.legend(fontsize=7)


def _lines_over_sets(sets: Sequence[tuple[StaticFit, StaticPoints]]) -> list[Line]:
    """Return measured and predicted breakaway of each direction, set by set."""
    lines: list[Line] = []
    for name, sign in (("positive", 1.0), ("negative", -1.0)):
        own = [np.sign(fit.measured) == sign for fit, _ in sets]
        at = np.concatenate([np.full(int(mask.sum()), float(k)) for k, mask in enumerate(own)])
        pairs = list(zip((fit for fit, _ in sets), own, strict=True))
        measured = np.concatenate([fit.measured[mask] for fit, mask in pairs])
        lines.append((name, at, measured, np.concatenate([fit.predicted[mask] for fit, mask in pairs])))
    return lines


def _lines_over_position(fit: StaticFit, position: np.ndarray) -> list[Line]:
    """Return measured and predicted effort over position, speed by speed."""
    lines: list[Line] = []
    for speed in np.unique(fit.speed):
        own = fit.speed == speed
        lines.append((f"{speed:g} rad/s", position[own], fit.measured[own], fit.predicted[own]))
    return lines


def _draw_run(panel: Axes, run: FreeRun, units: Mapping[str, str]) -> None:
    name, unit = next(iter(units.items()))
    seen = np.flatnonzero(np.isfinite(run.measured[:, 0]))
    seen = seen[:: max(1, seen.size // SAMPLES)]
    panel.plot(run.time[seen], run.measured[seen, 0], color="tab:gray", lw=2.5, label="measured")
    panel.plot(run.time[seen], run.simulated[seen, 0], color="tab:blue", lw=1.0, label="simulated")
    panel.set(xlabel="time, s", ylabel=f"{name}, {unit}", title=run.name)
    panel.legend()


def sections_of(page: str) -> dict[str, str]:
    """Return the sections of a page by their title."""
    parts = re.split(r"^## ", page, flags=re.MULTILINE)[1:]
    return {part.partition("\n")[0].strip(): f"## {part.rstrip()}\n" for part in parts}


def main(arguments: Sequence[str] | None = None) -> None:
    """Renew the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="TEXT", help="only problems whose path contains this")
    parser.add_argument("--out", type=Path, default=HERE, metavar="FOLDER", help="where the page is, or is to be")
    asked = parser.parse_args(arguments)
    page_file = asked.out / PAGE.name
    kept = sections_of(page_file.read_text(encoding="utf-8")) if page_file.is_file() else {}
    paths = problem_files()
    for path in paths:
        if asked.only in str(path.relative_to(HERE)):
            kept[f"{path.parent.name}/{path.stem}"] = section(path, asked.out)
            print(path.relative_to(HERE), flush=True)
        titles = [f"{one.parent.name}/{one.stem}" for one in paths]
        page = "\n".join([OPENING, *(kept[title] for title in titles if title in kept)])
        page_file.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()

"""The lines of the two telescopes, measured; `acceptance.py telescopes` prints them.

Draws are made by telescope_draws.py and kept in results/telescopes; those that are there are not made again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import aries_grid
import coverage
import lto_grid
import numpy as np
import random_starts
import telescope_draws
from checks import Check
from papers import papers
from problem_files import gallery_line
from servo import all_of

from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.model import prepare
from friction_ocp.problem_file.load import load_problem

PROBLEMS = aries_grid.ROOT / "problems"
Record = Mapping[str, Any]

SURE = 0.95
"""Probability from which a model is called the right one; below it the models are undistinguishable."""
RIGHT = 58 / 60
LTO_MOST = {"motor.friction.slopes.1": 0.05}
"""Largest median relative error of a number of the Leighton telescope where it is not LTO_OTHERWISE."""
LTO_OTHERWISE = 0.02
TRADED = ("motor-load.stiffness", "load.friction.tau_c", "load.friction.viscous")
SHARE = 1.0 / 20.0
MOST = {"sigma1": 0.10}
"""Largest median relative error of a number of the ARIES model where it is not OTHERWISE."""
OTHERWISE, MOST_DELTA = 0.03, 0.05
LIKE_THE_PLANT = {"period": 0.10, "rms_speed": 0.10, "area": 0.05}


def probabilities(fits: Record) -> dict[str, float]:
    """Return the Akaike weight of each model: as the noise is stated, objectives are negative log-likelihoods."""
    criteria = {name: fits[name]["objective"] + len(fits[name]["values"]) for name in telescope_draws.MODELS}
    least = min(criteria.values())
    weights = {name: float(np.exp(least - value)) for name, value in criteria.items()}
    return {name: weight / sum(weights.values()) for name, weight in weights.items()}


def choices(draws: Sequence[tuple[str, Record]]) -> Check:
    """How often the model that made the data is the most probable one, and by how much."""
    right, unsure, wrong = 0, 0, list[str]()
    for name, record in draws:
        weights = probabilities(record["fits"])
        best = max(weights, key=lambda key: weights[key])
        if weights[best] < SURE:
            unsure += 1
        elif best == name.split("-")[1]:
            right += 1
        else:
            wrong.append(name)
    told = f"{right} of {len(draws)} right, {unsure} undistinguishable, wrong: {', '.join(wrong) or 'none'}"
    made = telescope_draws.versions([record for _, record in draws])
    return Check("choice of the model", told + made, right >= RIGHT * len(draws) and not wrong)


def accuracy(records: Sequence[Record]) -> Check:
    """Median errors of the model that made the data, break at the high-speed part, and coverage of its intervals."""
    truth = records[0]["truth"]
    fits = [record["fits"]["high"] for record in records]
    medians = {
        name: float(np.median([abs(fit["values"][name] / value - 1.0) for fit in fits]))
        for name, value in truth.items()
    }
    inside = [
        {name: fit["intervals"][name][0] <= value <= fit["intervals"][name][1] for name, value in truth.items()}
        for fit in fits
    ]
    covered, low, high = coverage.pooled([{"covered": own} for own in inside])
    told = ", ".join(f"{name} {error:.2%}" for name, error in medians.items())
    held = all(error <= LTO_MOST.get(name, LTO_OTHERWISE) for name, error in medians.items())
    told += f"; intervals at 95 % cover {covered:.1%} of {len(fits) * len(truth)}"
    told += f" (band of draws resampled whole {low:.1%} to {high:.1%})"
    return Check(f"J fixed, {len(fits)} draws, median error", told, held and low <= covered <= high)


def trades(records: Sequence[Record]) -> Check:
    """In how many draws the slow side is reported as traded with an inertia known to 3 %."""
    fits = [record["fits"]["prior"]["verdicts"] for record in records]
    counts = {name: sum("load.inertia" in fit[name][1:] for fit in fits) for name in TRADED}
    told = ", ".join(f"{name} in {count} of {len(fits)}" for name, count in counts.items())
    return Check("3 % prior on J, traded with it", told, all(count == len(fits) for count in counts.values()))


def against_grid(contests: Sequence[lto_grid.Contest]) -> list[Check]:
    """What identify needs to where the grid ends, as a share of what the grid needs."""
    found = lto_grid.shares(contests)
    table = "\n".join(lto_grid.rows(contests))
    spacing = f"{lto_grid.VALUES} values of each, refined between neighbours to {lto_grid.FINEST:g} of the range"
    checks = [
        Check(
            f"against the {grid} ({spacing})",
            f"{cost[0]:.3g} of its evaluations, {cost[1]:.3g} of its time",
            max(cost) <= SHARE,
        )
        for grid, cost in found.items()
    ]
    return [*checks[:-1], replace(checks[-1], measured=f"{checks[-1].measured}\n{table}")]


def lto(line: str, quick: bool) -> Check:
    """Choice of the model, accuracy, coverage, the prior on J, and the grid beside identify."""
    draws = list(telescope_draws.draws("lto", 1 if quick else 25))
    high = [record for name, record in draws if name.startswith("lto-high")]
    contests = [lto_grid.read(record) for _, record in telescope_draws.draws("grid", 1 if quick else 25)]
    return all_of(line, [choices(draws), accuracy(high), trades(high), *against_grid(contests)])


def joint_errors(direction: str, records: Sequence[Record]) -> Check:
    """Return the median errors of the joint fit, and of the two steps beside them."""
    truth = aries_grid.truth_of(direction) | {"inertia": aries_grid.aries.INERTIA}
    sides = [record["sides"][direction] for record in records]
    fits = [{name.rpartition(".")[2]: value for name, value in side["joint"]["values"].items()} for side in sides]
    medians = _medians([aries_grid.two_step.errors_of(fit, truth) for fit in fits])
    beside = _medians([aries_grid.two_step.errors_of(side["two_steps"], truth) for side in sides])
    held = all(error <= MOST.get(name, OTHERWISE) for name, error in medians.items() if name != "delta")
    held = held and medians["delta"] * truth["delta"] <= MOST_DELTA
    told = [f"{name} {error:.2%} ({beside[name]:.1%})" if name in beside else f"{name} {error:.2%}"
            for name, error in medians.items()]  # fmt: skip
    made = telescope_draws.versions(records)
    return Check(f"{direction}, {len(records)} draws{made}, median error (two steps)", ", ".join(told), held)


def _medians(errors: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {name: float(np.median([error[name] for error in errors])) for name in errors[0]}


def motions(records: Sequence[Record]) -> Check:
    """How far limit cycle and presliding loop of the identified models are from the plant's: the worst of all draws."""
    worst: dict[str, float] = {}
    for record in records:
        for quantities in record["motions"].values():
            for name, (measured, simulated) in quantities.items():
                worst[name] = max(worst.get(name, 0.0), abs(simulated / measured - 1.0))
    told = ", ".join(f"{name.replace('_', ' ')} {error:.2%}" for name, error in worst.items())
    gains = (
        f"kp {aries_grid.aries.KP:g} N m s/rad, ki {aries_grid.aries.KI:g} N m/rad, {aries_grid.aries.SAMPLE_TIME:g} s"
    )
    held = all(error <= LIKE_THE_PLANT[name] for name, error in worst.items())
    return Check(f"limit cycle at 1.11e-4 rad/s ({gains}) and loop, worst of {len(records)} draws", told, held)


def coarse_log() -> Check:
    """What a step file logged at 10 ms is said to tell."""
    found = identify(load_problem(PROBLEMS / "aries" / "coarse_log.yaml"))
    told = ", ".join(f"{item.name} {item.verdict.word}" for item in found.parameters)
    return Check(
        "steps logged at 10 ms", told, all(item.verdict.word == "not_identifiable" for item in found.parameters)
    )


def aries(line: str, quick: bool) -> Check:
    """Errors of the joint fit over draws, what it makes of limit cycle and loop, and the coarse log."""
    records = [record for _, record in telescope_draws.draws("aries", 1 if quick else telescope_draws.ARIES_DRAWS)]
    checks = [joint_errors(direction, records) for direction in aries_grid.SIDES]
    return all_of(line, [*checks, coarse_log(), motions(records)])


def starts(line: str, quick: bool) -> Check:
    """How many random starts reach the same optimum."""
    records = [*telescope_draws.draws("starts", 3 if quick else telescope_draws.STARTS)]
    checks: list[Check] = []
    for key, path in telescope_draws.STARTED.items():
        own = [record for name, record in records if name.startswith(f"start-{key}")]
        names = prepare(load_problem(path)).space.names
        found = random_starts.summarise(f"{path.parent.name}/{path.stem}", names, [*map(telescope_draws.end_of, own)])
        told = random_starts.measured(found) + telescope_draws.versions(own)
        checks.append(Check(f"{found.problem}: same optimum", told, found.passed))
    return all_of(line, checks)


MEASURES: Mapping[str, Callable[[str, bool], Check]] = {
    "papers": papers,
    "lto": lto,
    "aries": aries,
    "random_starts": starts,
    "gallery": gallery_line,
}
"""By ID in done_when.yaml."""

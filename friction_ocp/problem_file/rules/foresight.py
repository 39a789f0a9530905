"""What the recordings cannot tell, from the sensitivities at the guesses: before any fit, by computation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.combinations import told
from friction_ocp.estimation.foresight import WORTH_A_WORD, Doubt, Survey, doubts, survey
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.probes import probes
from friction_ocp.parameters import Free
from friction_ocp.problem_file.rules.case import Case, quantity_text

SHOWN = 3
"""Channels that are named as a remedy, the best first."""
VAGUE = 1.0
"""Relative standard error from which nothing is said about its size: the parameter is not known at all."""


def recordings_tell_the_parameters(case: Case) -> Iterator[Finding]:
    """Every fitted parameter is told by the recordings, by itself; what is not is spelled out with its remedy."""
    if not any(isinstance(leaf.value, Free) for leaf in case.leaves.values()):
        return
    try:
        with np.errstate(all="ignore"):  # absurd numbers come out as steps that are none
            model = prepare(case.problem)
    except FrictionOcpError:
        return
    seen = survey(model) if model.max_step > 0 else None
    found = () if seen is None else doubts(seen)
    if seen is None or not found:
        return
    for doubt in found:
        yield _finding(case, model, seen, doubt)


def _finding(case: Case, model: Model, seen: Survey, doubt: Doubt) -> Finding:
    names = [seen.space.names[k] for k in doubt.members]
    where = case.at(case.place(names[0].partition("@")[0]))
    what = f"nothing in the recordings tells {names[0]}" if doubt.unseen else _traded(case, seen, doubt)
    fix = "fix it or give it a prior" if doubt.unseen else f"fix {_one_of(names)} or give it a prior"
    return Finding(where, what, remedy=f"{fix}, {_sensors(model, seen, doubt)}", severity="warning")


def _traded(case: Case, seen: Survey, doubt: Doubt) -> str:
    names = [seen.space.names[k] for k in doubt.members]
    ratios = {path: number for path, number in case.numbers.items() if path.endswith(".ratio")}
    chain = float(np.prod([number for number in ratios.values()])) if len(ratios) > 1 else 1.0
    texts = [item.text({**ratios, "chain": chain}) for item in told(seen, doubt)]
    errors = seen.by_sight(doubt)[0].errors
    sizes = [f"{names[n]} to {errors[k]:.0%}" for n, k in enumerate(doubt.members) if errors[k] < VAGUE]
    known = f" (at the guess {', '.join(sizes)})" if sizes else ""
    if not texts:
        return f"the recordings do not tell {_listed(names)} apart{known}"
    return f"the recordings tell {'; '.join(texts)}, but not {_listed(names)} by themselves{known}"


def _listed(names: list[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _one_of(names: list[str]) -> str:
    return "one of them" if len(names) > 1 else "it"


def _sensors(model: Model, seen: Survey, doubt: Doubt) -> str:
    """Name the channels that would end the doubt and halve the errors, those with the smallest errors first."""
    view, members = seen.by_sight(doubt)[0], list(doubt.members)
    before = float(np.max(view.errors[members]))
    good: list[tuple[float, str]] = []
    for probe in probes(view.program, view.point, view.system, model.problem.drive):
        worst = float(np.max(replace(view, system=probe.system).errors[members]))
        if worst < WORTH_A_WORD and worst < 0.5 * before:
            noise = quantity_text(float(f"{probe.noise_std:.1g}"), probe.unit)
            good.append((worst, f"{probe.measures} ({worst:.1%} with a noise of {noise})"))
    if not good:
        return "or record a motion that tells it: no further channel would"
    return f"or record in addition {' or '.join(text for _, text in sorted(good)[:SHOWN])}"

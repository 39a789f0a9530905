"""Models of the same recordings, side by side."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.estimate import Estimate
from friction_ocp.estimation.horizon import fits_free_run, horizon
from friction_ocp.estimation.problem import Problem
from friction_ocp.execution.content import fingerprint
from friction_ocp.execution.linear_algebra import with_one_thread
from friction_ocp.statistics.answer import answer
from friction_ocp.statistics.execution import Execution
from friction_ocp.statistics.lead import Lead, held_out_lead
from friction_ocp.statistics.nesting import NOT_WORSE, LikelihoodRatio, likelihood_ratios
from friction_ocp.statistics.scores import Scores, effective_samples, scores_of
from friction_ocp.statistics.workshop import Workshop

Criterion = Literal["held_out", "aicc"]


@dataclass(frozen=True)
class Candidate:
    """One model and what it is worth."""

    name: str
    estimate: Estimate
    scores: Scores
    behind: Lead | None = None
    """Lead of the model with the best held-out likelihood over this one."""


@dataclass(frozen=True)
class Comparison:
    """Models of the same recordings, best first."""

    candidates: tuple[Candidate, ...]
    """The first is the one with fewest parameters among those that no more than chance parts from the best."""
    ranked_by: Criterion
    """`held_out` likelihood where there are validation recordings or points, else `aicc`."""
    effective_samples: Mapping[str, float]
    """Independent errors of training: by channel, and of static points by kind."""
    ratios: tuple[LikelihoodRatio, ...]
    """Of all pairs of which one model is a special case of the other."""
    warnings: tuple[str, ...]


@with_one_thread
def compare(
    problems: Sequence[Problem], nested: Sequence[tuple[str, str]] = (), execution: Execution = Execution()
) -> Comparison:
    """Fit several models of the same recordings and static points and rank them.

    Likelihoods are those of the free run and of static points, with the size of the errors of each channel, or kind of
    points, estimated beside the parameters and samples counted as far as they are independent (`scores_of`,
    `effective_samples`). `nested` states pairs (name of the special case, name of the general model) beside those that
    are recognised (`is_nested`). Raises FrictionOcpError where the problems are not about the same samples.
    """
    names = names_of(problems)
    alike = _alike(problems, names)
    _refuse_unknown(nested, names)
    found = [answer(problem, execution) for problem in alike]
    largest = max(found, key=lambda item: len(item.estimate.parameters)).estimate
    sizes = effective_samples(largest.simulation)
    candidates = [
        Candidate(name, item.estimate, scores_of(item.estimate, sizes)) for name, item in zip(names, found, strict=True)
    ]
    unseen = problems[0].validation or problems[0].static_validation
    criterion: Criterion = "held_out" if unseen else "aicc"
    ranked = _preferred_first(sorted(candidates, key=lambda item: _rank(item.scores, criterion)), criterion, sizes)
    fits = dict(zip(names, found, strict=True))
    ratios = likelihood_ratios([(item.name, fits[item.name]) for item in ranked], nested)
    return Comparison(ranked, criterion, sizes, ratios, (*_warnings(ranked, ratios), *_doubts(ranked, ratios, sizes)))


def names_of(problems: Sequence[Problem]) -> list[str]:
    """Return the name of each problem: its file, else its title, numbered where that is not unique."""
    stems = [problem.path.stem if problem.path else problem.title for problem in problems]
    seen: Counter[str] = Counter()
    names: list[str] = []
    for stem in stems:
        seen[stem] += 1
        names.append(stem if seen[stem] == 1 else f"{stem}-{seen[stem]}")
    return names


def _rank(scores: Scores, criterion: Criterion) -> float:
    return scores.aicc if criterion == "aicc" or scores.held_out is None else -scores.held_out


def _preferred_first(
    ranked: Sequence[Candidate], criterion: Criterion, sizes: Mapping[str, float]
) -> tuple[Candidate, ...]:
    """Return the models with the simplest first of those that tie with the best by held-out likelihood."""
    if criterion != "held_out":
        return tuple(ranked)
    best = ranked[0].estimate
    led = [replace(item, behind=held_out_lead(best, item.estimate, sizes)) for item in ranked]
    tied = [item for item in led if item.behind is not None and item.behind.tied]
    simplest = min(tied, key=lambda item: item.scores.parameters)
    return (simplest, *(item for item in led if item is not simplest))


def _alike(problems: Sequence[Problem], names: Sequence[str]) -> list[Problem]:
    """Return the problems, judged over the same horizon; raises every way in which they are not about the same."""
    if len(problems) < 2:
        raise FrictionOcpError(Finding("compare", f"{len(problems)} problem given", "two or more"))
    findings = [
        finding
        for problem, name in zip(problems[1:], names[1:], strict=True)
        for finding in _different_data(problems[0], names[0], problem, name)
    ]
    if findings:
        raise FrictionOcpError(findings)
    models = [Workshop(problem).model for problem in problems]
    for model, name in zip(models[1:], names[1:], strict=True):
        findings += [
            Finding(
                name,
                f"the noise floor of {channel} is {floor.std:.4g}, in {names[0]} {other.std:.4g}",
                remedy="state it",
            )
            for channel, floor in model.floors.items()
            if not np.isclose(floor.std, (other := models[0].floors[channel]).std, rtol=1e-9)
        ]
        if fits_free_run(model) != fits_free_run(models[0]):
            remedy = "state estimation.fit in both"
            findings.append(Finding(name, f"only one of this and {names[0]} fits the free run", remedy=remedy))
    spans = [horizon(model) for model in models]
    finite = [span for span in spans if span is not None]
    if finite and len(finite) < len(spans):
        findings.append(
            Finding("compare", "only some are judged over windows", remedy="state estimation.horizon_s in all")
        )
    if findings:
        raise FrictionOcpError(findings)
    if len(set(spans)) == 1:
        return list(problems)
    return [replace(item, estimation=replace(item.estimation, horizon_s=min(finite))) for item in problems]


def _different_data(first: Problem, name: str, other: Problem, other_name: str) -> list[Finding]:
    """Return in which samples, channels and loss two problems differ."""
    findings: list[Finding] = []
    parts: tuple[Literal["train"], Literal["validation"]] = ("train", "validation")
    for part in parts:
        ours, theirs = (_data(problem, part) for problem in (first, other))
        if ours.keys() != theirs.keys():
            odd = sorted({**ours, **theirs}[key] for key in ours.keys() ^ theirs.keys())
            what = f"the {part} recordings or static points differ from those of {name}: {', '.join(odd)}"
            findings.append(Finding(other_name, what, "the same samples in all problems"))
    ours, theirs = ({channel.name for channel in problem.drive.outputs} for problem in (first, other))
    if ours != theirs:
        what = f"the fitted channels differ from those of {name}: {', '.join(sorted(ours ^ theirs))}"
        findings.append(Finding(other_name, what, "the same channels in all problems"))
    if first.estimation.loss != other.estimation.loss:
        what = f"the loss is {other.estimation.loss}, in {name} {first.estimation.loss}"
        findings.append(Finding(other_name, what, "the same loss in all problems"))
    return findings


def _data(problem: Problem, part: Literal["train", "validation"]) -> dict[str, str]:
    """Return the names of recordings and static points by what they hold."""
    runs = problem.train if part == "train" else problem.validation
    points = problem.static if part == "train" else problem.static_validation
    told = {fingerprint(dict(use.recording.channels)): use.name for use in runs}
    return told | {fingerprint(use.points.sha256, dict(use.points.columns)): use.name for use in points}


def _refuse_unknown(nested: Sequence[tuple[str, str]], names: Sequence[str]) -> None:
    unknown = [name for pair in nested for name in pair if name not in names]
    if unknown:
        allowed = f"one of {', '.join(names)}"
        raise FrictionOcpError([Finding("compare", f"there is no problem '{name}'", allowed) for name in unknown])


def _warnings(ranked: Sequence[Candidate], ratios: Sequence[LikelihoodRatio]) -> tuple[str, ...]:
    texts = [
        f"{item.name} did not converge: {item.estimate.message}. Its place may be better than it looks."
        for item in ranked
        if not item.estimate.converged
    ]
    texts += [
        f"{item.general} contains {item.special} and ended worse: its fit is not at its optimum. Run multistart on it."
        for item in ratios
        if item.statistic is None and item.added > 0
    ]
    return tuple(texts)


def _doubts(
    ranked: Sequence[Candidate], ratios: Sequence[LikelihoodRatio], sizes: Mapping[str, float]
) -> tuple[str, ...]:
    """Return why likelihood ratios are not to be believed."""
    scores, count = {item.name: item.scores for item in ranked}, sum(sizes.values())
    tested = [item for item in ratios if item.statistic is not None]
    texts = [
        f"{item.general} contains {item.special}, but its free run is less likely (log-likelihood "
        f"{scores[item.general].log_likelihood:.4g} to {scores[item.special].log_likelihood:.4g}): do not go by the "
        f"p-value of their ratio, which compares what was fitted. Run multistart on {item.general}, or state "
        "estimation.fit: simulation in both."
        for item in tested
        if scores[item.general].log_likelihood < scores[item.special].log_likelihood - 0.5 * NOT_WORSE * count
    ]
    texts += [
        f"{item.general} adds {', '.join(item.at_bound)} to {item.special}, at its bound: the p-value of their ratio "
        "does not hold there. Widen the bound, or fix the parameter, and compare again."
        for item in tested
        if item.at_bound
    ]
    return tuple(texts)

"""Statistics of an identification as documents: that of the identification, and a section of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from friction_ocp.result_document import estimate_document, number, problem_file, provenance
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.bootstrap import Bootstrap
from friction_ocp.statistics.compare import Candidate, Comparison
from friction_ocp.statistics.multistart import SAME_OBJECTIVE, SAME_PARAMETER, MultiStart, StartEnd
from friction_ocp.statistics.profile import Profile, Profiles

MULTISTART_FORMAT = "friction-ocp-multistart/1"
PROFILE_FORMAT = "friction-ocp-profile/1"
BOOTSTRAP_FORMAT = "friction-ocp-bootstrap/1"
COMPARE_FORMAT = "friction-ocp-compare/1"

Statistic = MultiStart | Profiles | Bootstrap | Comparison


def statistic_document(statistic: Statistic) -> dict[str, Any]:
    """Return the content of result.json."""
    match statistic:
        case MultiStart():
            return multistart_document(statistic)
        case Profiles():
            return profile_document(statistic)
        case Bootstrap():
            return bootstrap_document(statistic)
        case Comparison():
            return comparison_document(statistic)


def multistart_document(found: MultiStart) -> dict[str, Any]:
    """Return every start with its end, and what ends are the same optimum."""
    names = [item.name for item in found.estimate.parameters]
    document = estimate_document(found.estimate)
    return {
        **document,
        "format": MULTISTART_FORMAT,
        "warnings": [*found.warnings, *document["warnings"]],
        "multistart": {
            "same_objective": SAME_OBJECTIVE,
            "same_parameter": SAME_PARAMETER,
            "optima": [_optimum(found, members, names) for members in found.clusters],
            "starts": [_start(end, names) for end in found.ends],
        },
        "provenance": provenance(found.estimate.problem, "multistart", {"starts": len(found.ends)}),
    }


def _optimum(found: MultiStart, members: Sequence[int], names: Sequence[str]) -> dict[str, Any]:
    best = found.ends[members[0]].optimum
    for k in members:
        other = found.ends[k].optimum
        if best is None or (other is not None and other.solution.objective < best.solution.objective):
            best = other
    assert best is not None
    return {
        "objective": best.solution.objective,
        "starts": len(members),
        "parameters": _named(names, best.solution.point.theta),
    }


def _start(end: StartEnd, names: Sequence[str]) -> dict[str, Any]:
    solution = None if end.optimum is None else end.optimum.solution
    return {
        "start": _named(names, end.start),
        "end": None if solution is None else _named(names, solution.point.theta),
        "objective": None if solution is None else number(solution.objective),
        "converged": solution is not None and solution.converged,
        "message": end.error if solution is None else solution.message,
        "iterations": None if solution is None else solution.iterations,
        "seconds": end.seconds,
        "optimum": end.cluster,
    }


def profile_document(found: Profiles) -> dict[str, Any]:
    """Return the points of every profile, where it meets the threshold, and its verdict."""
    document = estimate_document(found.estimate)
    return {
        **document,
        "format": PROFILE_FORMAT,
        "warnings": [*found.warnings, *document["warnings"]],
        "profile": {
            "confidence": 0.95,
            "threshold": found.threshold,
            "parameters": {item.parameter.name: _profile(item) for item in found.items},
        },
        "provenance": provenance(
            found.estimate.problem, "profile", {"parameters": [item.parameter.name for item in found.items]}
        ),
    }


def _profile(item: Profile) -> dict[str, Any]:
    return {
        "verdict": item.verdict,
        "interval95": list(item.interval),
        "ends": list(item.ends),
        "value": item.parameter.value,
        "unit": item.parameter.unit,
        "std_error": number(item.parameter.std_error),
        "scale": item.scale,
        "points": [
            {"value": float(value), "ratio": float(ratio), "parameters": theta.tolist(), "converged": converged}
            for value, ratio, theta, converged in zip(
                item.values, item.ratios, item.thetas, item.converged, strict=True
            )
        ],
    }


def bootstrap_document(found: Bootstrap) -> dict[str, Any]:
    """Return the draws, their scatter beside the standard errors, and the blocks."""
    document = estimate_document(found.estimate)
    names = [item.name for item in found.estimate.parameters]
    rows = zip(found.estimate.parameters, found.std_error, found.percentiles, strict=True)
    return {
        **document,
        "format": BOOTSTRAP_FORMAT,
        "warnings": [*found.warnings, *document["warnings"]],
        "bootstrap": {
            "method": found.method,
            "drawn": len(found.draws) + found.failed,
            "failed": found.failed,
            "blocks": [
                {
                    "recording": item.recording,
                    "length_s": item.length_s,
                    "wanted_s": item.wanted_s,
                    "count": item.count,
                }
                for item in found.blocks
            ],
            "parameters": {
                item.name: {
                    "value": item.value,
                    "unit": item.unit,
                    "std_error": float(std_error),
                    "covariance_std_error": number(item.std_error),
                    "median": float(percentiles[1]),
                    "interval95": [float(percentiles[0]), float(percentiles[2])],
                }
                for item, std_error, percentiles in rows
            },
            "draws": {"names": names, "values": found.draws.tolist()},
        },
        "provenance": provenance(found.estimate.problem, "bootstrap", {"draws": len(found.draws) + found.failed}),
    }


def comparison_document(found: Comparison) -> dict[str, Any]:
    """Return the models, best first; what belongs to one estimate is that of the best."""
    best = found.candidates[0]
    document = estimate_document(best.estimate)
    converged = all(item.estimate.converged for item in found.candidates)
    return {
        **document,
        "format": COMPARE_FORMAT,
        "status": "converged" if converged else "not_converged",
        "title": f"{len(found.candidates)} models of the same recordings",
        "problem": ", ".join(
            item.estimate.problem.path.name for item in found.candidates if item.estimate.problem.path
        ),
        "warnings": [*found.warnings, *(f"{best.name}: {warning}" for warning in document["warnings"])],
        "compare": {
            "ranked_by": found.ranked_by,
            "effective_samples": dict(found.effective_samples),
            "models": [_model(item, found.candidates) for item in found.candidates],
            "likelihood_ratios": [
                {
                    "special": item.special,
                    "general": item.general,
                    "stated": item.stated,
                    "added": item.added,
                    "statistic": item.statistic,
                    "p_value": item.p_value,
                    "at_bound": list(item.at_bound),
                }
                for item in found.ratios
            ],
        },
        "provenance": {
            **provenance(
                best.estimate.problem,
                "compare",
                {"nested": [[item.special, item.general] for item in found.ratios if item.stated]},
            ),
            "problems": [problem_file(item.estimate.problem) for item in found.candidates],
        },
    }


def _model(item: Candidate, among: Sequence[Candidate]) -> dict[str, Any]:
    document = estimate_document(item.estimate)
    scores, others = item.scores, [other.scores for other in among]
    return {
        "name": item.name,
        "title": document["title"],
        "status": document["status"],
        "fitted": len(item.estimate.parameters),
        "log_likelihood": scores.log_likelihood,
        "aicc": number(scores.aicc),
        "bic": scores.bic,
        "held_out": scores.held_out,
        "behind": None if item.behind is None else {"held_out": item.behind.difference, "chance": item.behind.chance},
        "delta_aicc": number(scores.aicc - min(other.aicc for other in others)),
        "delta_bic": scores.bic - min(other.bic for other in others),
        "train": document["fit"]["train"],
        "validation": document["fit"]["validation"],
        "parameters": document["parameters"],
    }


def _named(names: Sequence[str], values: FloatArray) -> Mapping[str, float]:
    return {name: float(value) for name, value in zip(names, np.asarray(values), strict=True)}

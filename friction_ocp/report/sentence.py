"""The answer of an identification in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from friction_ocp.plots.numbers import is_number, plain, significant, unit_text
from friction_ocp.plots.reading import Json, objects, part

_NAMED = 3  # channels named before the rest is counted


def verdict_sentence(result: Json) -> str:
    """Say whether the solver converged, how well the free run explains the machine, and what is determined."""
    sentences = [_status(result), _fit(part(result, "fit"))]
    if result.get("status") == "converged":
        sentences.append(_determined(objects(result, "parameters")))
    return " ".join(sentence for sentence in sentences if sentence)


def _status(result: Json) -> str:
    if result.get("status") == "converged":
        return "Converged."
    message = str(result.get("message") or "the solver gave no reason").strip().rstrip(".")
    return f"Not converged: {message}. What follows is the last iterate, not an answer."


def _fit(fit: Json) -> str:
    train, validation = objects(fit, "train"), objects(fit, "validation")
    channels = [name for name in train if is_number(train[name].get("mae"))]
    if not channels:
        return ""
    horizon = fit.get("horizon_s")
    run = f"Free run over windows of {plain(horizon, 3)} s" if is_number(horizon) else "Free run"
    named = channels[:_NAMED]
    explained = _listed([f"{name} to {_error(train[name])}" for name in named])
    rest = len(channels) - len(named)
    if rest:
        explained += f" ({rest} more channel{'s' * (rest > 1)} below)"
    held_out = [_error(validation[name]) for name in named if name in validation]
    tail = f", {_listed(held_out)} on validation" if held_out else "; nothing was held out for validation"
    return f"{run} explains {explained} (mean abs) on training{tail}."


def _determined(parameters: Mapping[str, Json]) -> str:
    sound = sum(parameter.get("verdict") == "ok" for parameter in parameters.values())
    if not parameters:
        return ""
    if sound == len(parameters):
        return "Every parameter is determined." if sound > 1 else "The parameter is determined."
    return f"{sound} of {len(parameters)} parameters are determined."


def _error(channel: Json) -> str:
    return f"{significant(channel.get('mae'), 2)} {unit_text(str(channel.get('unit', '')))}".rstrip()


def _listed(items: Sequence[str]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"

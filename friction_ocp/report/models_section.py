"""The section of a comparison of models."""

from __future__ import annotations

from collections.abc import Sequence

from friction_ocp.plots.numbers import is_number, significant, unit_text
from friction_ocp.plots.reading import Json, objects, part, rows
from friction_ocp.report.section import StatisticSection, StatisticTable, columns, listed

_CRITERIA = {"held_out": "held-out likelihood", "aicc": "AICc"}
_SPLITS = {"train": "training", "validation": "validation"}


def models_section(found: Json, result: Json) -> StatisticSection:
    """Rank the models and test the nested ones."""
    sizes = listed(f"{name} {significant(size, 3)}" for name, size in part(found, "effective_samples").items())
    note = (
        f"Independent samples, from the autocorrelation of the errors of the model with most parameters: {sizes}. "
        "Likelihoods are those of the free run and of static points, the size of their errors estimated by channel. "
        "The rest of the page "
        "shows the best model."
    )
    return StatisticSection(
        kind="Comparison of models",
        title="Models",
        sentence=_sentence(rows(found, "models"), str(found["ranked_by"])),
        notes=(note,),
        picture="Criteria and errors of the models",
        tables=(_models_table(rows(found, "models")), *_tests(rows(found, "likelihood_ratios"))),
    )


def _sentence(models: Sequence[Json], ranked_by: str) -> str:
    best = str(models[0]["name"])
    text = _tie(models) or f"{best} is best by {_CRITERIA[ranked_by]}"
    others = {word: _least(models, key) for word, key in (("AICc", "delta_aicc"), ("BIC", "delta_bic"))}
    if ranked_by == "aicc":
        others.pop("AICc")
    for name in dict.fromkeys(filter(None, others.values())):
        words = " and ".join(word for word, least in others.items() if least == name)
        text += f"; {'so it' if name == best else name} is by {words}"
    return f"{text}."


def _tie(models: Sequence[Json]) -> str:
    """Return which models nothing but chance parts from the best by held-out likelihood, and which is preferred."""
    parted = {str(model["name"]): part(model, "behind") for model in models if model.get("behind")}
    tied = {name: lead for name, lead in parted.items() if float(lead["held_out"]) <= float(lead["chance"])}
    if len(tied) < 2:
        return ""
    widest = max(tied.values(), key=lambda lead: float(lead["held_out"]))
    lead, chance = (significant(widest[key], 2) for key in ("held_out", "chance"))
    return (
        f"{listed(tied)} tie by held-out likelihood (a lead of {lead}, where chance alone reaches {chance} at 95 %), "
        f"and {next(iter(tied))} is preferred as the simplest"
    )


def _least(models: Sequence[Json], key: str) -> str:
    known = [model for model in models if is_number(model[key])]
    return str(min(known, key=lambda model: float(model[key]))["name"]) if known else ""


def _models_table(models: Sequence[Json]) -> StatisticTable:
    channels = list(objects(models[0], "train"))
    errors = [f"{channel}, {word}" for channel in channels for word in _SPLITS.values()]
    heads = "|".join(["Fitted", "Held-out log-lik.", "Log-likelihood", "ΔAICc", "ΔBIC", *errors])
    caption = "Models, best first, with the rms error of the free run."
    return StatisticTable(caption, columns("Model", heads), tuple(_row(model, channels) for model in models))


def _row(model: Json, channels: Sequence[str]) -> tuple[str, ...]:
    shown = str(model["name"]) + ("" if model["status"] == "converged" else " (not converged)")
    criteria = (significant(model[key], 4) for key in ("held_out", "log_likelihood", "delta_aicc", "delta_bic"))
    errors = (objects(model, split).get(channel, {}) for channel in channels for split in _SPLITS)
    written = (
        f"{significant(error.get('rms'), 3)} {unit_text(str(error.get('unit', '')))}".strip() for error in errors
    )
    return shown, str(model["fitted"]), *criteria, *written


def _tests(tests: Sequence[Json]) -> tuple[StatisticTable, ...]:
    if not tests:
        return ()
    caption = (
        "Likelihood ratio of nested models: a small p-value says that the recordings need the general one. The ratio "
        "is of what was fitted, which may be short predictions, not of the free run, and is scaled for residuals that "
        "are not white."
    )
    cells = tuple(
        (
            str(test["special"]),
            f"{test['general']}{' (stated)' if test['stated'] else ''}",
            str(test["added"]),
            significant(test["statistic"], 3),
            significant(test["p_value"], 2),
        )
        for test in tests
    )
    heads = columns("Special case | General model", "Parameters more | Ratio | p-value")
    return (StatisticTable(caption, heads, cells),)

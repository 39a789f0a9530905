"""The section of a report, and the lines of a summary, that a statistic adds to an identification."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from friction_ocp.plots.figures import statistic_figures
from friction_ocp.plots.numbers import NOTHING, is_number, significant, to_resolution, unit_text
from friction_ocp.plots.profiles import PROFILE_WORDS
from friction_ocp.plots.reading import Json, objects, part, rows
from friction_ocp.plots.style import figure_style, svg_text
from friction_ocp.report.sentence import verdict_sentence

_END_WORDS = {
    "threshold": "",
    "bound": "open up to its bound",
    "far": "open as far as it was followed",
    "points": "not followed to its end",
    "solver": "the solver failed",
    "failed": "failed",
}
_CRITERIA = {"held_out": "held-out likelihood", "aicc": "AICc"}


@dataclass(frozen=True)
class Column:
    """Head of a column."""

    head: str
    number: bool = True


@dataclass(frozen=True)
class StatisticTable:
    """A table whose cells are written out."""

    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class StatisticSection:
    """What a statistic adds to the page of an identification."""

    kind: str
    title: str
    notes: tuple[str, ...]
    sentence: str
    figure: str
    """SVG in base64."""
    figure_text: str
    tables: tuple[StatisticTable, ...]


def statistic_section(result: Json, with_figure: bool = True) -> StatisticSection | None:
    """Return the section of the statistic that a result holds; None for a plain identification."""
    for key, section in _SECTIONS.items():
        if part(result, key):
            return section(part(result, key), result, _figure(result) if with_figure else "")
    return None


def _figure(result: Json) -> str:
    with figure_style():
        texts = [svg_text(figure) for _, figure in statistic_figures(result)]
    return base64.b64encode(texts[0].encode()).decode() if texts else ""


def _multistart(found: Json, result: Json, figure: str) -> StatisticSection:
    starts, optima = rows(found, "starts"), rows(found, "optima")
    lowest = float(optima[0]["objective"])
    rest = [
        f"{optimum['starts']} end {significant(100 * (float(optimum['objective']) / lowest - 1), 2)} % above"
        for optimum in optima[1:4]
        if lowest
    ]
    missing = sum(start["optimum"] is None for start in starts)
    sentence = f"{optima[0]['starts']} of {len(starts)} starts reach the best optimum"
    sentence += f"; {', '.join(rest)}" if rest else ""
    sentence += f"; {missing} failed." if missing else "."
    guess = starts[0]["optimum"]
    sentence += " The guess reaches it." if guess == 0 else " The guess does not."
    table = StatisticTable(
        f"Ends that are the same optimum: objectives within {100 * float(found['same_objective']):g} %, parameters "
        f"within {found['same_parameter']:g} standard errors.",
        (
            Column("Optimum"),
            Column("Starts"),
            Column("Objective"),
            *(Column(name) for name in objects(result, "parameters")),
        ),
        tuple(
            (
                str(k + 1),
                str(optimum["starts"]),
                f"{float(optimum['objective']):.7g}",
                *(significant(value) for value in part(optimum, "parameters").values()),
            )
            for k, optimum in enumerate(optima)
        ),
    )
    every = StatisticTable(
        "Every start, in order; the first is the guess.",
        (
            Column("Start"),
            Column("Optimum"),
            Column("Objective"),
            Column("Iterations"),
            Column("Seconds"),
            Column("Message", False),
        ),
        tuple(
            (
                str(k + 1),
                NOTHING if start["optimum"] is None else str(start["optimum"] + 1),
                NOTHING if start["objective"] is None else f"{float(start['objective']):.7g}",
                NOTHING if start["iterations"] is None else str(start["iterations"]),
                significant(start["seconds"], 3),
                str(start["message"]),
            )
            for k, start in enumerate(starts)
        ),
    )
    notes = ("Starts fill a Latin hypercube within a factor √10 of the guess, inside the bounds.",)
    return StatisticSection(
        "Multi-start identification",
        "Starts",
        notes,
        sentence,
        figure,
        "Waterfall of the ends of all starts",
        (table, every),
    )


def _profile(found: Json, result: Json, figure: str) -> StatisticSection:
    items = objects(found, "parameters")
    words = {word: [name for name, item in items.items() if item["verdict"] == word] for word in PROFILE_WORDS}
    sentence = f"{len(words['finite'])} of {len(items)} parameters have a finite likelihood interval"
    for word in ("one_sided", "flat"):
        sentence += f"; {PROFILE_WORDS[word][0]}: {', '.join(words[word])}" if words[word] else ""
    table = StatisticTable(
        "Likelihood intervals at 95 % beside those of the standard error.",
        (
            Column("Parameter", False),
            Column("Value"),
            Column("Unit", False),
            Column("Likelihood interval"),
            Column("From the standard error"),
            Column("Verdict", False),
            Column("Scale"),
            Column("Remark", False),
        ),
        tuple(_profile_row(name, item, objects(result, "parameters")[name]) for name, item in items.items()),
    )
    notes = (
        "One parameter is held, the others are optimal. Dashed: the 95 % threshold; dotted: the parabola of the "
        "standard error; shaded: what the recordings do not exclude.",
        "Twice the rise of the objective is divided by the scale, sandwich variance over inverse information, which is "
        "1 for white residuals of the stated noise.",
    )
    return StatisticSection(
        "Profile likelihood",
        "Profiles",
        notes,
        f"{sentence}.",
        figure,
        "Profile likelihood of every parameter",
        (table,),
    )


def _profile_row(name: str, item: Json, parameter: Json) -> tuple[str, ...]:
    std_error = item.get("std_error")
    remarks = zip(("below", "above"), rows(item, "ends"), strict=True)
    return (
        name,
        to_resolution(item["value"], std_error),
        unit_text(str(item["unit"])),
        _interval(rows(item, "interval95"), std_error),
        _interval(rows(parameter, "interval95"), std_error),
        PROFILE_WORDS[str(item["verdict"])][0],
        significant(item["scale"], 3),
        "; ".join(f"{side}: {_END_WORDS[end]}" for side, end in remarks if _END_WORDS[end]),
    )


def _interval(ends: Sequence[object], std_error: object) -> str:
    if not any(is_number(end) for end in ends):
        return NOTHING
    low, high = ends
    text = (
        to_resolution(low, std_error) if is_number(low) else "…",
        to_resolution(high, std_error) if is_number(high) else "…",
    )
    return f"{text[0]} to {text[1]}"


def _bootstrap(found: Json, result: Json, figure: str) -> StatisticSection:
    items = objects(found, "parameters")
    ratios = [
        float(item["std_error"]) / float(item["covariance_std_error"])
        for item in items.values()
        if is_number(item["covariance_std_error"]) and item["covariance_std_error"]
    ]
    sentence = f"{found['drawn'] - found['failed']} draws"
    if ratios:
        low, high = significant(min(ratios), 2), significant(max(ratios), 2)
        sentence += f" scatter by {low} to {high} times the standard errors of the fit"
    blocks = rows(found, "blocks")
    lengths = [float(block["length_s"]) for block in blocks]
    ways = {
        "refit": "and the simulation with these residuals is fitted again from the optimum.",
        "one_step": "and the optimum moves by the Gauss-Newton step of the resampled scores, within the bounds.",
    }
    notes = (
        f"Blocks of {significant(min(lengths), 2)} to {significant(max(lengths), 2)} s of residuals, as long as their "
        f"autocorrelation asks for, get random signs, {ways[str(found['method'])]}",
    )
    table = StatisticTable(
        "Draws beside the standard errors of the fit.",
        (
            Column("Parameter", False),
            Column("Value"),
            Column("Unit", False),
            Column("95 % of the draws"),
            Column("From the standard error"),
            Column("Std. error of draws"),
            Column("Std. error of fit"),
            Column("Median"),
        ),
        tuple(
            (
                name,
                to_resolution(item["value"], item["std_error"]),
                unit_text(str(item["unit"])),
                _interval(rows(item, "interval95"), item["std_error"]),
                _interval(rows(objects(result, "parameters")[name], "interval95"), item["std_error"]),
                significant(item["std_error"], 2),
                significant(item["covariance_std_error"], 2),
                to_resolution(item["median"], item["std_error"]),
            )
            for name, item in items.items()
        ),
    )
    cut = StatisticTable(
        "Blocks by recording.",
        (Column("Recording", False), Column("Blocks"), Column("Length in s"), Column("Asked for in s")),
        tuple(
            (
                str(block["recording"]),
                str(block["count"]),
                significant(block["length_s"], 3),
                significant(block["wanted_s"], 3),
            )
            for block in blocks
        ),
    )
    return StatisticSection(
        "Bootstrap", "Bootstrap", notes, f"{sentence}.", figure, "Bootstrap draws of every parameter", (table, cut)
    )


def _compare(found: Json, result: Json, figure: str) -> StatisticSection:
    models = rows(found, "models")
    best, ranked_by = str(models[0]["name"]), str(found["ranked_by"])
    sentence = f"{best} is best by {_CRITERIA[ranked_by]}"
    others = {word: _least(models, key) for word, key in (("AICc", "delta_aicc"), ("BIC", "delta_bic"))}
    if ranked_by == "aicc":
        others.pop("AICc")
    agree = [word for word, name in others.items() if name == best]
    sentence += f"; so it is by {' and '.join(agree)}" if agree else ""
    sentence += "".join(f"; {name} is by {word}" for word, name in others.items() if name and name != best)
    sizes = ", ".join(f"{name} {significant(size, 3)}" for name, size in part(found, "effective_samples").items())
    notes = (
        f"Independent samples, from the autocorrelation of the errors of the model with most parameters: {sizes}. "
        "Likelihoods are those of the free run, the size of its errors estimated by channel. The rest of the page "
        "shows the best model.",
    )
    channels = list(objects(models[0], "train"))
    errors = tuple(Column(f"{channel}, {word}") for channel in channels for word in ("training", "validation"))
    heads = ("Fitted", "Held-out log-lik.", "Log-likelihood", "ΔAICc", "ΔBIC")
    table = StatisticTable(
        "Models, best first, with the rms error of the free run.",
        (Column("Model", False), *(Column(head) for head in heads), *errors),
        tuple(_model_row(model, channels) for model in models),
    )
    return StatisticSection(
        "Comparison of models",
        "Models",
        notes,
        f"{sentence}.",
        figure,
        "Criteria and errors of the models",
        (table, *_tests(found)),
    )


def _least(models: Sequence[Json], key: str) -> str:
    known = [model for model in models if is_number(model[key])]
    return str(min(known, key=lambda model: float(model[key]))["name"]) if known else ""


def _model_row(model: Json, channels: Sequence[str]) -> tuple[str, ...]:
    shown = str(model["name"]) + ("" if model["status"] == "converged" else " (not converged)")
    criteria = (significant(model[key], 4) for key in ("held_out", "log_likelihood", "delta_aicc", "delta_bic"))
    errors: list[str] = []
    for channel in channels:
        for split in ("train", "validation"):
            error = objects(model, split).get(channel, {})
            errors.append(f"{significant(error.get('rms'), 3)} {unit_text(str(error.get('unit', '')))}".strip())
    return shown, str(model["fitted"]), *criteria, *errors


def _tests(found: Json) -> tuple[StatisticTable, ...]:
    tests: Sequence[Mapping[str, object]] = rows(found, "likelihood_ratios")
    if not tests:
        return ()
    caption = (
        "Likelihood ratio of nested models: a small p-value says that the recordings need the general one. The ratio "
        "is scaled for residuals that are not white."
    )
    heads = (
        Column("Special case", False),
        Column("General model", False),
        Column("Parameters more"),
        Column("Ratio"),
        Column("p-value"),
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
    return (StatisticTable(caption, heads, cells),)


_SECTIONS = {"multistart": _multistart, "profile": _profile, "bootstrap": _bootstrap, "compare": _compare}


def whole_verdict(result: Json) -> str:
    """Return what a statistic found, if the result has one, and the answer of the identification."""
    statistic, answer = statistic_section(result, with_figure=False), verdict_sentence(result)
    if statistic is None:
        return answer
    parts = (statistic.sentence, answer) if result.get("status") == "converged" else (answer, statistic.sentence)
    return " ".join(parts)


def table_lines(table: StatisticTable) -> list[str]:
    """Return a table as aligned plain text, without the columns that are empty."""
    cells = [tuple(column.head for column in table.columns), *table.rows]
    kept = [k for k in range(len(table.columns)) if any(row[k] for row in table.rows)]
    widths = {k: max(len(row[k]) for row in cells) for k in kept}
    return [
        "  ".join(
            row[k].rjust(widths[k]) if table.columns[k].number else row[k].ljust(widths[k]) for k in kept
        ).rstrip()
        for row in cells
    ]

"""The statistic that a result holds, for its page and for its summary."""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.plots.figures import statistic_figures
from friction_ocp.plots.reading import Json, part
from friction_ocp.plots.style import figure_style, svg_text
from friction_ocp.report.bootstrap_section import bootstrap_section
from friction_ocp.report.models_section import models_section
from friction_ocp.report.pictures import embedded_svg
from friction_ocp.report.profile_section import profile_section
from friction_ocp.report.section import StatisticSection
from friction_ocp.report.sentence import verdict_sentence
from friction_ocp.report.starts_section import starts_section

_SECTIONS = {
    "multistart": starts_section,
    "profile": profile_section,
    "bootstrap": bootstrap_section,
    "compare": models_section,
}
"""By the key of a result."""


def statistic_section(result: Json) -> StatisticSection | None:
    """Return the section of the statistic that a result holds, without its figure; None for an identification."""
    for key, section in _SECTIONS.items():
        if part(result, key):
            return section(part(result, key), result)
    return None


def drawn_section(result: Json) -> StatisticSection | None:
    """Return the same with its figure."""
    section = statistic_section(result)
    if section is None:
        return None
    with figure_style():
        drawn = [embedded_svg(svg_text(figure)) for _, figure in statistic_figures(result)]
    return replace(section, figure=drawn[0])


def whole_verdict(result: Json) -> str:
    """Return what a statistic found, if the result has one, and the answer of the identification."""
    statistic, answer = statistic_section(result), verdict_sentence(result)
    if statistic is None:
        return answer
    parts = (statistic.sentence, answer) if result.get("status") == "converged" else (answer, statistic.sentence)
    return " ".join(parts)

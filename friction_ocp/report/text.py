"""A result in a few lines of plain text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from friction_ocp.plots.numbers import significant
from friction_ocp.report.compensation import compensation_sentence
from friction_ocp.report.section import Column, StatisticTable, table_lines
from friction_ocp.report.statistics import statistic_section, whole_verdict
from friction_ocp.report.tables import parameter_rows

_HEADS = ("parameter", "value", "95 % interval", "relative", "unit", "verdict")

_NUMBERS = _HEADS[1:4]


def summary(result: Mapping[str, Any]) -> str:
    """Return warnings, parameter table and free-run errors of a result document; of a statistic, its tables."""
    lines = [result["title"], ""]
    statistic = statistic_section(result)
    if result["parameters"]:
        lines += [whole_verdict(result), ""]
    lines += [f"! {warning}" for warning in result["warnings"]]
    lines += [""] if result["warnings"] else []
    if statistic is not None:
        return "\n".join([*lines, *(line for table in statistic.tables for line in (*table_lines(table), ""))]).rstrip()
    lines += _parameter_lines(result["parameters"])
    lines += _parameter_lines(
        {f"torque noise on {name}": item for name, item in result.get("process_noise", {}).items()}
    )
    for name, errors in result["fit"]["train"].items():
        lines.append(f"free run, training    {name}: {_error(errors)}")
    for name, errors in result["fit"]["validation"].items():
        lines.append(f"free run, validation  {name}: {_error(errors)}")
    if sentence := compensation_sentence(result):
        lines += ["", sentence]
    return "\n".join(lines)


def _parameter_lines(parameters: Mapping[str, Mapping[str, Any]]) -> list[str]:
    if not parameters:
        return []
    found = [
        (row.name, row.value.text, row.interval.text, row.relative.text, row.unit, row.verdict)
        for row in parameter_rows(parameters)
    ]
    heads = (Column(head, head in _NUMBERS) for head in _HEADS)
    return [*table_lines(StatisticTable("", tuple(heads), tuple(found))), ""]


def _error(errors: Mapping[str, Any]) -> str:
    rms, mean, ratio = (significant(errors[key], 3) for key in ("rms", "mae", "noise_ratio"))
    unit = errors["unit"]
    return f"rms {rms} {unit}, mean absolute {mean} {unit}, {ratio} x noise floor ({errors['noise_source']})"

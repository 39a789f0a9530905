"""A result in a few lines of plain text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from friction_ocp.report.compensation import compensation_sentence
from friction_ocp.report.section import table_lines
from friction_ocp.report.statistics import statistic_section, whole_verdict


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
    width = max(len(name) for name in parameters)
    lines: list[str] = []
    for name, item in parameters.items():
        doubt = "" if item["std_error"] is None else f" +- {1.96 * item['std_error']:.2g}"
        lines.append(f"{name:<{width}}  {item['value']:>11.5g}{doubt:<12} {item['unit']:<14} {item['verdict']}")
    return [*lines, ""]


def _error(errors: Mapping[str, Any]) -> str:
    return (
        f"rms {errors['rms']:.4g} {errors['unit']}, mean absolute {errors['mae']:.4g} {errors['unit']}, "
        f"{errors['noise_ratio']:.3g} x noise floor ({errors['noise_source']})"
    )

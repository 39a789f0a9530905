"""Results on disk: result.json, result.h5, report.html, figures; every file whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.estimate import Estimate, Simulation
from friction_ocp.estimation.score import numbers_of_own
from friction_ocp.recording.result_series import RecordingSeries
from friction_ocp.result_document import estimate_document, simulation_document, simulation_series
from friction_ocp.statistics.compare import Comparison
from friction_ocp.statistics_document import Statistic, statistic_document
from friction_ocp.whole_file import write_text

Arrays = dict[str, dict[str, dict[str, Any]]]


def save(result: Estimate | Simulation | Statistic, folder: str | Path) -> Path:
    """Write everything that a command leaves behind and return the folder."""
    target = Path(folder)
    if isinstance(result, Statistic):
        best = result.candidates[0].estimate if isinstance(result, Comparison) else result.estimate
        write_results(target, statistic_document(result), simulation_series(best.simulation))
    elif isinstance(result, Estimate):
        fitted, document = fitted_problem(result, target), estimate_document(result)
        document["friction_compensation"] = friction_compensation(result)
        write_results(target, document, simulation_series(result.simulation), fitted)
    else:
        write_results(target, simulation_document(result), simulation_series(result))
    return target


def friction_compensation(estimate: Estimate) -> dict[str, Any] | None:
    """Return what cancelling the friction is predicted to buy; None where no controller follows a recorded angle."""
    from friction_ocp.targets.fitted import fitted_of
    from friction_ocp.targets.tracking import follows, tracking_document, tracking_gain

    if not (follows(estimate.problem.drive) and estimate.converged):
        return None
    fitted = fitted_of(estimate)
    return tracking_document(fitted, tracking_gain(fitted))


def fitted_problem(estimate: Estimate, folder: Path) -> str | None:
    """Return the text of fitted.yaml; None for a problem that its file, if any, no longer describes."""
    from friction_ocp.problem_file.dump import dump_problem

    path, run = estimate.problem.path, estimate.simulation
    if path is None:
        return None
    try:
        values = {**estimate.values, **numbers_of_own(run.validation)}
        return dump_problem(path, values, folder, run.max_step, estimate.problem.text, run.horizon_s)
    except FrictionOcpError:  # parameters that were added after the file was read
        return None


def write_results(
    folder: Path, document: Mapping[str, Any], series: Mapping[str, RecordingSeries], fitted: str | None = None
) -> None:
    """Write result.json, result.h5, report.html, figures/ and, for a fit, fitted.yaml."""
    from friction_ocp.plots.figures import write_figures
    from friction_ocp.recording.hdf5 import write_result_series
    from friction_ocp.report.page import write_report

    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(document, indent=1, allow_nan=False)
    write_text(folder / "result.json", text)
    write_result_series(folder / "result.h5", series)
    if fitted is not None:
        write_text(folder / "fitted.yaml", fitted)
    arrays = plain_arrays(series)
    write_report(document, arrays, folder / "report.html")
    write_figures(document, arrays, folder / "figures")


def plain_arrays(series: Mapping[str, RecordingSeries]) -> Arrays:
    """Return {recording: {channel: {time, measured, simulated}}} for reports and figures."""
    return {
        recording: {
            name: {"time": channel.time, "measured": channel.measured, "simulated": channel.simulated}
            for name, channel in content.channels.items()
        }
        for recording, content in series.items()
    }

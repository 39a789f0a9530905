"""A diagnosis on disk: result.json, result.h5, base.yaml and augmented.yaml, report.html, figures, and the next run."""

from __future__ import annotations

import json
from pathlib import Path

from friction_ocp.diagnosis.diagnose import Diagnosis
from friction_ocp.diagnosis.free_gap import FreeErrors
from friction_ocp.diagnosis_document import diagnosis_document
from friction_ocp.drive.units import signal_unit
from friction_ocp.estimation.score import numbers_of_own
from friction_ocp.excitation.next_experiment import follow_up
from friction_ocp.execution.executor import AbstractExecutor, InProcess
from friction_ocp.recording.result_series import RecordingSeries
from friction_ocp.result_document import run_series
from friction_ocp.result_folder import plain_arrays
from friction_ocp.whole_file import write_text


def save_diagnosis(diagnosis: Diagnosis, folder: str | Path, executor: AbstractExecutor = InProcess()) -> Path:
    """Write everything that `diagnose` leaves behind and return the folder.

    The executor works on what to record next.
    """
    from friction_ocp.plots.diagnosis import diagnosis_figures
    from friction_ocp.plots.figures import file_stem
    from friction_ocp.plots.style import figure_style, save
    from friction_ocp.problem_file.write import write_problem
    from friction_ocp.recording.hdf5 import write_recording, write_result_series
    from friction_ocp.report.diagnosis_page import write_diagnosis_report

    target = Path(folder)
    following = follow_up(diagnosis, executor)
    document = diagnosis_document(diagnosis, following)
    target.mkdir(parents=True, exist_ok=True)
    before, after = (_series(diagnosis, errors) for errors in (diagnosis.before, diagnosis.after))
    write_text(target / "result.json", json.dumps(document, indent=1, allow_nan=False))
    write_result_series(target / "result.h5", after)
    path = diagnosis.problem.path
    if path is not None:
        ends = (
            ("base.yaml", diagnosis.base, diagnosis.before),
            ("augmented.yaml", diagnosis.final, diagnosis.after),
        )
        for name, fitted, errors in ends:
            model, source = fitted.model, diagnosis.problem.text
            settings = (model.max_step, source, model.problem.estimation.horizon_s)
            values = {**fitted.values, **numbers_of_own(errors.runs)}
            text = write_problem(path, model.problem.drive, values, target, *settings)
            write_text(target / name, text)
    if following is not None and following.option is not None:
        write_recording(following.option.run.recording, target / "next_experiment.h5")
    pictures: dict[str, Path] = {}
    taken: set[str] = set()
    (target / "figures").mkdir(exist_ok=True)
    with figure_style():
        for name, figure in diagnosis_figures(document, plain_arrays(before), plain_arrays(after)):
            pictures[name] = save(figure, target / "figures" / file_stem(name, taken))[0]
    write_diagnosis_report(document, pictures, target / "report.html")
    return target


def _series(diagnosis: Diagnosis, errors: FreeErrors) -> dict[str, RecordingSeries]:
    drive, model = diagnosis.problem.drive, diagnosis.base.model
    units = {item.name: signal_unit(drive, item.measures) for item in drive.outputs}
    own = model if errors is diagnosis.before else diagnosis.final.model
    return {run.name: run_series(run, units, own.drive.state_names) for run in errors.runs}

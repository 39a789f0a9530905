"""A design on disk: result.json, result.h5, excitation.h5, report.html and figures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from friction_ocp.design_document import RECORDING, design_document
from friction_ocp.drive.units import signal_unit
from friction_ocp.excitation.design import Design
from friction_ocp.recording.result_series import ChannelSeries, RecordingSeries
from friction_ocp.result_folder import plain_arrays
from friction_ocp.whole_file import write_text


def save_design(design: Design, folder: str | Path) -> Path:
    """Write everything that `design` leaves behind and return the folder."""
    from friction_ocp.plots.design import design_figures
    from friction_ocp.plots.style import figure_style, save
    from friction_ocp.recording.hdf5 import write_recording, write_result_series
    from friction_ocp.report.design_page import write_design_report

    target = Path(folder)
    (target / "figures").mkdir(parents=True, exist_ok=True)
    document, series = design_document(design), _series(design)
    write_text(target / "result.json", json.dumps(document, indent=1, allow_nan=False))
    write_result_series(target / "result.h5", series)
    if design.options:
        write_recording(design.options[0].run.recording, target / RECORDING)
    pictures: dict[str, Path] = {}
    with figure_style():
        for name, figure in design_figures(document, plain_arrays(series)):
            pictures[name] = save(figure, target / "figures" / name)[0]
    write_design_report(document, pictures, target / "report.html")
    return target


def _series(design: Design) -> dict[str, RecordingSeries]:
    """Return the expected outputs of every motion; nothing was measured yet."""
    found: dict[str, RecordingSeries] = {}
    for option in design.options:
        channels: dict[str, ChannelSeries] = {}
        for item in design.problem.drive.channels:
            one = option.run.recording.channels[item.name]
            unknown = np.full(one.time.size, np.nan)
            channels[item.name] = ChannelSeries(
                one.time, unknown, one.values, signal_unit(design.problem.drive, item.measures)
            )
        found[option.run.motion.name] = RecordingSeries(channels)
    return found

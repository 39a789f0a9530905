"""A fleet on disk: result.json, result.h5, report.html, figures; the store is there already."""

from __future__ import annotations

import json
from pathlib import Path

from friction_ocp.fleet.batch import Fleet
from friction_ocp.fleet_document import fleet_document, fleet_series
from friction_ocp.whole_file import write_text


def save_fleet(fleet: Fleet, folder: str | Path) -> Path:
    """Write everything that `batch` leaves behind beside its store and return the folder."""
    from friction_ocp.plots.figures import file_stem
    from friction_ocp.plots.fleet import fleet_figures
    from friction_ocp.plots.style import figure_style, save
    from friction_ocp.recording.hdf5 import write_result_series
    from friction_ocp.report.fleet_page import write_fleet_report

    target = Path(folder)
    document = fleet_document(fleet)
    target.mkdir(parents=True, exist_ok=True)
    write_text(target / "result.json", json.dumps(document, indent=1, allow_nan=False))
    write_result_series(target / "result.h5", fleet_series(fleet))
    (target / "figures").mkdir(exist_ok=True)
    taken: set[str] = set()
    with figure_style():
        for name, figure in fleet_figures(document):
            save(figure, target / "figures" / file_stem(name, taken))
    write_fleet_report(document, target / "report.html")
    return target

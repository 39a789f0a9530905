"""What a command leaves behind, whatever its result is."""

from __future__ import annotations

from pathlib import Path

from friction_ocp import result_folder
from friction_ocp.design_folder import save_design
from friction_ocp.diagnosis.diagnose import Diagnosis
from friction_ocp.diagnosis_folder import save_diagnosis
from friction_ocp.estimation.estimate import Estimate, Simulation
from friction_ocp.excitation.design import Design
from friction_ocp.fleet.batch import Fleet
from friction_ocp.fleet_folder import save_fleet
from friction_ocp.statistics_document import Statistic

Result = Estimate | Simulation | Statistic | Diagnosis | Design | Fleet


def save(result: Result, folder: str | Path) -> Path:
    """Write result.json, result.h5, report.html, figures and whatever else belongs to a result; return the folder."""
    match result:
        case Diagnosis():
            return save_diagnosis(result, folder)
        case Design():
            return save_design(result, folder)
        case Fleet():
            return save_fleet(result, folder)
        case _:
            return result_folder.save(result, folder)

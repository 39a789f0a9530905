"""An exported FMU, run by FMPy over the recordings."""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.optional_library import optional_library
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.targets.fitted import Fitted, Run

ACTED = 6000


def fmpy_library(path: Path) -> Any:
    """Import FMPy; raises FrictionOcpError with the install command where it is missing."""
    return optional_library("fmpy", "FMPy", "fmu", str(path), "checking and running an FMU")


@contextmanager
def loaded_fmu(fitted: Fitted, path: Path) -> Generator[FmuRun]:
    """Check an FMU against its standard and load it; raises FrictionOcpError with what FMPy finds."""
    fmpy = fmpy_library(path)
    problems = importlib.import_module("fmpy.validation").validate_fmu(str(path))
    if problems:
        raise FrictionOcpError([Finding(str(path), str(problem)) for problem in problems])
    folder = fmpy.extract(str(path))
    try:
        yield FmuRun(fitted, path, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


class FmuRun:
    """An unpacked FMU."""

    def __init__(self, fitted: Fitted, path: Path, folder: str) -> None:
        description = fmpy_library(path).read_model_description(str(path))
        slave: Any = importlib.import_module("fmpy.fmi2").FMU2Slave
        names = {"modelIdentifier": description.coSimulation.modelIdentifier, "guid": description.guid}
        self._new: Any = lambda: slave(unzipDirectory=folder, instanceName="run", **names)
        self._fitted = fitted

    def simulate(self, run: Run) -> FloatArray:
        """Return (n, outputs) at the nodes of a recording, each window begun from the state of the free run."""
        y = np.full_like(run.free.simulated, np.nan)
        for begin, stop in zip(run.first[:-1], run.first[1:], strict=True):
            self._window(run, int(begin), int(stop), y)
        return y

    def _window(self, run: Run, begin: int, stop: int, y: FloatArray) -> None:
        grid, drive = run.item.grid, self._fitted.model.drive
        fmu = self._new()
        fmu.instantiate()
        fmu.setupExperiment(startTime=float(grid.time[begin]))
        _set(fmu, 3000, run.numbers)
        _set(fmu, 4000, run.free.states[begin])
        if drive.tick is not None:
            _set(fmu, ACTED, [1.0])
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        outputs = [2000 + k for k in range(len(drive.output_names))]
        for k in range(begin, stop + 1):
            _set(fmu, 1000, grid.at_node[k])
            fmu.doStep(float(grid.time[k]), 0.0)
            y[k] = fmu.getReal(outputs)
            if k < stop:
                _set(fmu, 1000, grid.at_start[k])
                _set_slopes(fmu, (grid.at_end[k] - grid.at_start[k]) / grid.dt[k])
                fmu.doStep(float(grid.time[k]), float(grid.dt[k]))
        fmu.terminate()
        fmu.freeInstance()


def _set(fmu: Any, first: int, values: Any) -> None:
    if len(values):
        fmu.setReal([first + k for k in range(len(values))], [float(value) for value in values])


def _set_slopes(fmu: Any, slopes: FloatArray) -> None:
    if len(slopes):
        references = [1000 + k for k in range(len(slopes))]
        fmu.setRealInputDerivatives(references, [1] * len(references), [float(slope) for slope in slopes])

"""Friction of drives, identified from their own logs."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from friction_ocp.errors import Finding, FrictionOcpError
    from friction_ocp.estimation.estimate import Estimate, Interrupted, Simulation, identify, simulate
    from friction_ocp.estimation.problem import EstimationOptions, Problem, RecordingUse
    from friction_ocp.problem_file.check import check
    from friction_ocp.problem_file.load import load_problem
    from friction_ocp.recording.hdf5 import read_recording, write_recording
    from friction_ocp.recording.import_recording import import_recording
    from friction_ocp.recording.recording import Channel, Recording
    from friction_ocp.result_folder import save
    from friction_ocp.statistics.bootstrap import bootstrap
    from friction_ocp.statistics.compare import compare
    from friction_ocp.statistics.execution import Execution
    from friction_ocp.statistics.multistart import multistart
    from friction_ocp.statistics.profile import profile

_HOMES = {
    "Channel": "recording.recording",
    "Estimate": "estimation.estimate",
    "EstimationOptions": "estimation.problem",
    "Execution": "statistics.execution",
    "Finding": "errors",
    "FrictionOcpError": "errors",
    "Interrupted": "estimation.estimate",
    "Problem": "estimation.problem",
    "Recording": "recording.recording",
    "RecordingUse": "estimation.problem",
    "Simulation": "estimation.estimate",
    "bootstrap": "statistics.bootstrap",
    "check": "problem_file.check",
    "compare": "statistics.compare",
    "identify": "estimation.estimate",
    "import_recording": "recording.import_recording",
    "load_problem": "problem_file.load",
    "multistart": "statistics.multistart",
    "profile": "statistics.profile",
    "read_recording": "recording.hdf5",
    "save": "result_folder",
    "simulate": "estimation.estimate",
    "write_recording": "recording.hdf5",
}

__all__ = [
    "Channel",
    "Estimate",
    "EstimationOptions",
    "Execution",
    "Finding",
    "FrictionOcpError",
    "Interrupted",
    "Problem",
    "Recording",
    "RecordingUse",
    "Simulation",
    "bootstrap",
    "check",
    "compare",
    "identify",
    "import_recording",
    "load_problem",
    "multistart",
    "profile",
    "read_recording",
    "save",
    "simulate",
    "write_recording",
]


def __getattr__(name: str) -> Any:
    """Import public names when they are first used, so that `import friction_ocp` stays quick."""
    if name not in _HOMES:
        raise AttributeError(f"module 'friction_ocp' has no attribute '{name}'")
    return getattr(importlib.import_module(f"friction_ocp.{_HOMES[name]}"), name)

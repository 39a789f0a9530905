"""Friction of drives, identified from their own logs."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from friction_ocp.diagnosis.diagnose import Diagnosis, diagnose
    from friction_ocp.drafts.draft import init
    from friction_ocp.effects.registry import register_effect
    from friction_ocp.errors import Finding, FrictionOcpError
    from friction_ocp.estimation.estimate import Estimate, Interrupted, Simulation, identify, simulate
    from friction_ocp.estimation.problem import EstimationOptions, Problem, RecordingUse
    from friction_ocp.excitation.design import Design, design
    from friction_ocp.fleet.batch import Fleet, batch
    from friction_ocp.friction.registry import register_law
    from friction_ocp.output_folder import save
    from friction_ocp.problem_file.check import check
    from friction_ocp.problem_file.load import load_problem
    from friction_ocp.recording.hdf5 import read_recording, write_recording
    from friction_ocp.recording.import_recording import import_recording, inspect_file
    from friction_ocp.recording.recording import Channel, Recording
    from friction_ocp.repetition import rerun
    from friction_ocp.statistics.bootstrap import bootstrap
    from friction_ocp.statistics.compare import compare
    from friction_ocp.statistics.execution import Execution
    from friction_ocp.statistics.multistart import multistart
    from friction_ocp.statistics.profile import profile
    from friction_ocp.targets.export import export
    from friction_ocp.targets.fitted import load_fitted

_HOMES = {
    "Channel": "recording.recording",
    "Design": "excitation.design",
    "Diagnosis": "diagnosis.diagnose",
    "Estimate": "estimation.estimate",
    "EstimationOptions": "estimation.problem",
    "Execution": "statistics.execution",
    "Finding": "errors",
    "Fleet": "fleet.batch",
    "FrictionOcpError": "errors",
    "Interrupted": "estimation.estimate",
    "Problem": "estimation.problem",
    "Recording": "recording.recording",
    "RecordingUse": "estimation.problem",
    "Simulation": "estimation.estimate",
    "batch": "fleet.batch",
    "bootstrap": "statistics.bootstrap",
    "check": "problem_file.check",
    "compare": "statistics.compare",
    "design": "excitation.design",
    "diagnose": "diagnosis.diagnose",
    "export": "targets.export",
    "identify": "estimation.estimate",
    "import_recording": "recording.import_recording",
    "init": "drafts.draft",
    "inspect_file": "recording.import_recording",
    "load_fitted": "targets.fitted",
    "load_problem": "problem_file.load",
    "multistart": "statistics.multistart",
    "profile": "statistics.profile",
    "read_recording": "recording.hdf5",
    "register_effect": "effects.registry",
    "register_law": "friction.registry",
    "rerun": "repetition",
    "save": "output_folder",
    "simulate": "estimation.estimate",
    "write_recording": "recording.hdf5",
}

__all__ = [
    "Channel",
    "Design",
    "Diagnosis",
    "Estimate",
    "EstimationOptions",
    "Execution",
    "Finding",
    "Fleet",
    "FrictionOcpError",
    "Interrupted",
    "Problem",
    "Recording",
    "RecordingUse",
    "Simulation",
    "batch",
    "bootstrap",
    "check",
    "compare",
    "design",
    "diagnose",
    "export",
    "identify",
    "import_recording",
    "init",
    "inspect_file",
    "load_fitted",
    "load_problem",
    "multistart",
    "profile",
    "read_recording",
    "register_effect",
    "register_law",
    "rerun",
    "save",
    "simulate",
    "write_recording",
]


def __getattr__(name: str) -> Any:
    """Import public names when they are first used, so that `import friction_ocp` stays quick."""
    if name not in _HOMES:
        raise AttributeError(f"module 'friction_ocp' has no attribute '{name}'")
    return getattr(importlib.import_module(f"friction_ocp.{_HOMES[name]}"), name)

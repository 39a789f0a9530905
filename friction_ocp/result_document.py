"""Results as the documents that files hold: plain dictionaries, lists, numbers and text."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib.metadata
import math
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

import numpy as np

from friction_ocp.estimation.agreement import Coherence, coherence
from friction_ocp.estimation.curves import FrictionCurve
from friction_ocp.estimation.estimate import Estimate, ParameterEstimate, Simulation
from friction_ocp.estimation.noise import NoiseLevel
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.score import Errors, FreeRun
from friction_ocp.estimation.static_points import StaticFit
from friction_ocp.estimation.whiteness import Whiteness
from friction_ocp.execution.content import fingerprint, toolkit_fingerprint
from friction_ocp.quantities import si_unit
from friction_ocp.recording.result_series import ChannelSeries, RecordingSeries, StateSeries
from friction_ocp.simulation.grid import FloatArray

FORMAT = "friction-ocp-result/1"
SIMULATION_FORMAT = "friction-ocp-simulation/1"
FREQUENCIES, FEWEST_SAMPLES = 200, 64
"""Frequencies that a coherence is kept at, and samples from which there is one."""


def number(value: float) -> float | None:
    """Return a float that JSON can hold; None for NaN and infinity."""
    return float(value) if math.isfinite(value) else None


def estimate_document(estimate: Estimate) -> dict[str, Any]:
    """Return the content of result.json for an identification."""
    return {
        "format": FORMAT,
        "status": "converged" if estimate.converged else "not_converged",
        "message": estimate.message,
        **heading(estimate.problem),
        "warnings": list(estimate.warnings),
        "parameters": {item.name: _parameter(item) for item in estimate.parameters},
        "process_noise": {item.shaft: _noise_level(item, estimate.problem) for item in estimate.noise_levels},
        "fit": _fit(estimate.simulation),
        "solver": {
            "name": estimate.solver.name,
            "iterations": estimate.solver.iterations,
            "seconds": estimate.solver.seconds,
            "build_seconds": estimate.solver.build_seconds,
            "objective": number(estimate.solver.objective),
            "starts": estimate.solver.starts,
        },
        "covariance": {
            "kind": estimate.uncertainty.kind,
            "names": [item.name for item in estimate.parameters],
            "matrix": _matrix(estimate.uncertainty.covariance),
            "freedom": number(estimate.uncertainty.freedom),
        },
        "correlation": {
            "names": [item.name for item in estimate.parameters],
            "matrix": _matrix(estimate.uncertainty.correlation),
        },
        "friction_curves": [_curve(curve, estimate.problem) for curve in estimate.curves],
        "residuals": {
            recording: {channel: _whiteness(test) for channel, test in tests.items()}
            for recording, tests in estimate.residuals.items()
        },
        "coherence": _coherences(estimate.simulation),
        "channel_units": dict(estimate.simulation.units),
        "provenance": provenance(estimate.problem, "identify"),
    }


def simulation_document(simulation: Simulation) -> dict[str, Any]:
    """Return the content of result.json for a simulation."""
    return {
        "format": SIMULATION_FORMAT,
        "status": "simulated",
        "message": "free-running simulation with the values of the problem file",
        **heading(simulation.problem),
        "warnings": [],
        "parameters": {},
        "fit": _fit(simulation),
        "coherence": _coherences(simulation),
        "channel_units": dict(simulation.units),
        "provenance": provenance(simulation.problem, "simulate"),
    }


def heading(problem: Problem) -> dict[str, Any]:
    """Return what every result says first: the question, and the recordings that it was put to."""
    return {
        "title": problem.title,
        "question": problem.question,
        "problem": problem.path.name if problem.path else "",
        "recordings": {
            "train": [use.name for use in problem.train],
            "validation": [use.name for use in problem.validation],
            "static": [use.name for use in (*problem.static, *problem.static_validation)],
        },
    }


def _parameter(item: ParameterEstimate) -> dict[str, Any]:
    verdict = item.verdict
    return {**_found(item), "guess": item.guess, "verdict": verdict.word, "traded_with": list(verdict.traded_with)}


def _noise_level(item: NoiseLevel, problem: Problem) -> dict[str, Any]:
    """Return an estimated level of torque noise under the keys of a parameter."""
    guess = problem.estimation.process_noise.get(item.shaft)
    return {**_found(item), "guess": guess, "verdict": item.verdict, "traded_with": []}


def _found(item: ParameterEstimate | NoiseLevel) -> dict[str, Any]:
    low, high = (number(end) for end in item.interval95)
    return {
        "value": item.value,
        "unit": item.unit,
        "std_error": number(item.std_error),
        "interval95": None if low is None or high is None else [low, high],
    }


def _fit(simulation: Simulation) -> dict[str, Any]:
    def table(errors: Mapping[str, tuple[Errors, Mapping[str, Errors]]]) -> dict[str, Any]:
        return {
            name: {
                **_errors(whole),
                "unit": simulation.units[name],
                "noise_std": simulation.floors[name].std,
                "noise_source": simulation.floors[name].source,
                "by_recording": {recording: _errors(item) for recording, item in parts.items()},
            }
            for name, (whole, parts) in errors.items()
        }

    return {
        "horizon_s": simulation.horizon_s,
        "train": table(simulation.train_errors),
        "validation": table(simulation.validation_errors),
        "static": {item.name: _static(item) for item in simulation.static},
        "own_values": {run.name: dict(run.own) for run in (*simulation.train, *simulation.validation) if run.own},
    }


def _coherences(simulation: Simulation) -> dict[str, Any]:
    """Return by recording and channel how far the measurement depends linearly on the free run, over frequency."""
    told: dict[str, Any] = {}
    for run in (*simulation.train, *simulation.validation):
        told[run.name] = {
            name: _coherence(coherence(run.time, run.measured[:, k], run.simulated[:, k]))
            for k, name in enumerate(simulation.units)
            if (np.isfinite(run.measured[:, k]) & np.isfinite(run.simulated[:, k])).sum() >= FEWEST_SAMPLES
        }
    return told


def _coherence(found: Coherence) -> dict[str, Any]:
    shown = found.thinned(FREQUENCIES)
    return {
        "frequency_hz": _numbers(shown.frequency[1:]),
        "share": _numbers(shown.share[1:]),
        "explained": number(found.explained),
    }


def _static(item: StaticFit) -> dict[str, Any]:
    """Return static points beside their prediction."""
    return {
        "split": item.split,
        "measures": item.effort,
        "unit": item.unit,
        "rms": number(item.rms),
        "noise_ratio": number(item.noise_ratio),
        "noise_source": item.noise_source,
        **{key: _numbers(getattr(item, key)) for key in ("speed", "measured", "predicted", "std_error")},
    }


def _errors(errors: Errors) -> dict[str, float | None]:
    names = ("rms", "mae", "relative", "relative_norm", "noise_ratio")
    return {name: number(getattr(errors, name)) for name in names}


def _numbers(values: FloatArray) -> list[float | None]:
    return [number(value) for value in values]


def _matrix(values: FloatArray) -> list[list[float | None]]:
    return [_numbers(row) for row in values]


def _curve(curve: FrictionCurve, problem: Problem) -> dict[str, Any]:
    motion = problem.drive.shaft(curve.shaft).motion
    return {
        "shaft": curve.shaft,
        "law": curve.law,
        "load": curve.load,
        "load_unit": si_unit("torque", motion),
        "speed": _numbers(curve.speed),
        "torque": _numbers(curve.torque),
        "lower": _numbers(curve.lower),
        "upper": _numbers(curve.upper),
        "speed_unit": si_unit("speed", motion),
        "torque_unit": si_unit("torque", motion),
    }


def _whiteness(test: Whiteness) -> dict[str, Any]:
    return {
        "lag_s": _numbers(test.lag_s),
        "autocorrelation": _numbers(test.autocorrelation),
        "band": number(test.band),
        "p_value": number(test.p_value),
        "white": test.white,
    }


def provenance(problem: Problem, command: str, options: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return all that it takes to make a result again: versions, command, problem, checksums, options and seed."""
    packages = ("friction-ocp", "casadi", "numpy", "scipy")
    return {
        **{name.replace("-", "_"): importlib.metadata.version(name) for name in packages},
        "python": platform.python_version(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "code": toolkit_fingerprint(),
        "command": {"name": command, "options": dict(options or {})},
        "problems": [problem_file(problem)],
        "model": fingerprint(problem.drive, problem.constraints),
        "options": dataclasses.asdict(problem.estimation),
        "seed": problem.estimation.seed,
        "recordings": {use.name: use.recording.sha256 for use in problem.recordings}
        | {use.name: use.points.sha256 for use in (*problem.static, *problem.static_validation)},
    }


def problem_file(problem: Problem) -> dict[str, Any] | None:
    """Return path, checksum and content of the file of a problem; None for one that was made otherwise."""
    if problem.path is None or not problem.text:
        return None
    digest = hashlib.sha256(problem.text.encode()).hexdigest()
    return {"path": problem.path.as_posix(), "sha256": digest, "text": problem.text}


def simulation_series(simulation: Simulation) -> dict[str, RecordingSeries]:
    """Return the content of result.h5: measured and simulated channels and states of every recording."""
    runs = (*simulation.train, *simulation.validation)
    return {run.name: _series(run, simulation) for run in runs}


def _series(run: FreeRun, simulation: Simulation) -> RecordingSeries:
    return run_series(run, simulation.units, simulation.state_names)


def run_series(run: FreeRun, units: Mapping[str, str], state_names: tuple[str, ...]) -> RecordingSeries:
    """Return measured and simulated channels and the states of one free run."""
    channels: dict[str, ChannelSeries] = {}
    for column, (name, unit) in enumerate(units.items()):
        at = np.isfinite(run.measured[:, column])
        if at.any():
            # a channel keeps the nodes between its first and last sample, missing ones as NaN
            inside = slice(int(np.argmax(at)), at.size - int(np.argmax(at[::-1])))
            stamps = run.time[inside] + run.late.get(name, 0.0)
            channels[name] = ChannelSeries(stamps, run.measured[inside, column], run.simulated[inside, column], unit)
    states = {name: run.states[:, k] for k, name in enumerate(state_names)}
    return RecordingSeries(channels, StateSeries(run.time, states))

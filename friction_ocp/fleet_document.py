"""A fleet as the document that result.json holds, and its series."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from friction_ocp.fleet.batch import Fleet
from friction_ocp.fleet.drift import FEWEST
from friction_ocp.fleet.judgement import Drift, Outlier, Series
from friction_ocp.fleet.store import StoredFit, StoredParameter
from friction_ocp.recording.result_series import ChannelSeries, RecordingSeries
from friction_ocp.result_document import heading, number, provenance
from friction_ocp.simulation.grid import FloatArray

FORMAT = "friction-ocp-batch/1"


def fleet_document(fleet: Fleet) -> dict[str, Any]:
    """Return the content of result.json for a fleet."""
    failed = [fit for fit in fleet.fits if fit.status != "converged"]
    return {
        "format": FORMAT,
        "status": "not_converged" if failed else "converged",
        "message": f"{len(fleet.fits) - len(failed)} of {len(fleet.fits)} fits converged",
        **heading(fleet.problem),
        "warnings": _warnings(fleet, failed),
        "false_alarm_rate": fleet.judgement.rate,
        "time": "days" if fleet.dated else "number of the recording",
        "machines": _machines(fleet),
        "drifts": [_drift(fleet, item) for item in fleet.judgement.drifts],
        "outliers": [_outlier(fleet, item) for item in fleet.judgement.outliers],
        "series": [_series(fleet, item) for item in fleet.series],
        "fits": [_fit(fit) for fit in fleet.fits],
        "provenance": {
            **provenance(
                fleet.problem,
                "batch",
                {"machine": fleet.machine, "started": fleet.started, "false_alarms": fleet.judgement.rate},
            ),
            "recordings": {fit.recording: fit.sha256 for fit in fleet.fits},
        },
    }


def fleet_series(fleet: Fleet) -> dict[str, RecordingSeries]:
    """Return the content of result.h5: by machine and parameter, the estimates over time and their level or drift."""
    found: dict[str, dict[str, ChannelSeries]] = {}
    for item in fleet.series:
        scale = 86400.0 if fleet.dated else 1.0
        channel = ChannelSeries(item.time * scale, item.value, _expected(fleet, item), item.unit)
        found.setdefault(item.machine.replace("/", "_"), {})[item.parameter] = channel
    return {machine: RecordingSeries(channels) for machine, channels in found.items()}


def _warnings(fleet: Fleet, failed: list[StoredFit]) -> list[str]:
    texts = [f"{fit.recording}: {fit.message}" for fit in failed]
    short = sorted({item.machine for item in fleet.series if item.value.size < FEWEST})
    if short:
        texts.append(f"Fewer than {FEWEST} fits, too few to tell a drift by: {', '.join(short)}.")
    if not fleet.dated:
        texts.append("Not every recording says when it was made: the order of their names stands for the time.")
    if fleet.others:
        texts.append(
            f"{fleet.others} fits in the store are of another problem or version of the toolkit and are left out; give "
            "their recordings again to have them here."
        )
    return texts


def _machines(fleet: Fleet) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for fit in fleet.fits:
        found.setdefault(fit.machine, {"fits": 0, "parameters": {}})["fits"] += 1
    for item in fleet.series:
        level = fleet.judgement.levels.get(item.key)
        if level is None:
            continue
        ends = level.interval95(0)
        found[item.machine]["parameters"][item.parameter] = {
            "value": float(level.coefficients[0]),
            "unit": item.unit,
            "std_error": number(float(np.sqrt(level.covariance[0, 0]))) if level.freedom else None,
            "interval95": None if ends is None else list(ends),
            "night_scatter": level.night_scatter,
            "fits": int(item.value.size),
        }
    return found


def _drift(fleet: Fleet, item: Drift) -> dict[str, Any]:
    level, shape, series = item.test.level, item.test.shape, item.series
    before, change = float(level.coefficients[0]), item.test.change
    ends = level.interval95(1)
    return {
        "machine": series.machine,
        "parameter": series.parameter,
        "unit": series.unit,
        "flagged": item.flagged,
        "p_value": item.test.p_value,
        "adjusted_p_value": item.adjusted,
        "shape": shape.kind,
        "after": fleet.fits[series.fits[shape.begins]].recording,
        "after_started": fleet.fits[series.fits[shape.begins]].started,
        "before": before,
        "change": change,
        "interval95": None if ends is None else list(ends),
        "relative": number(change / abs(before)) if before else None,
    }


def _outlier(fleet: Fleet, item: Outlier) -> dict[str, Any]:
    fit = fleet.fits[item.series.fits[item.place]]
    return {
        "machine": item.series.machine,
        "parameter": item.series.parameter,
        "unit": item.series.unit,
        "recording": fit.recording,
        "started": fit.started,
        "value": float(item.series.value[item.place]),
        "expected": item.expected,
        "distance": item.distance,
        "adjusted_p_value": item.adjusted,
    }


def _series(fleet: Fleet, item: Series) -> dict[str, Any]:
    outliers = {item.fits[found.place] for found in fleet.judgement.outliers if found.series.key == item.key}
    return {
        "machine": item.machine,
        "parameter": item.parameter,
        "unit": item.unit,
        "recordings": [fleet.fits[number].recording for number in item.fits],
        "time": item.time.tolist(),
        "value": item.value.tolist(),
        "std_error": item.std_error.tolist(),
        "expected": _expected(fleet, item).tolist(),
        "outlier": [number in outliers for number in item.fits],
        "drifts": any(found.series.key == item.key for found in fleet.judgement.flagged),
    }


def _expected(fleet: Fleet, item: Series) -> FloatArray:
    """Return (n,) the level, or the drift that was found, at every fit of a series."""
    level = fleet.judgement.levels.get(item.key)
    if level is None:
        return np.full(item.value.size, np.nan)
    drift = next((found for found in fleet.judgement.flagged if found.series.key == item.key), None)
    ones = np.ones(item.value.size)
    if drift is None:
        return level.at(ones[:, None])
    column = np.interp(item.time, drift.series.time, drift.test.shape.column)
    return level.at(np.column_stack([ones, column]))


def _fit(fit: StoredFit) -> dict[str, Any]:
    return {
        "machine": fit.machine,
        "recording": fit.recording,
        "started": fit.started,
        "sha256": fit.sha256,
        "status": fit.status,
        "message": fit.message,
        "created": fit.created,
        "seconds": fit.seconds,
        "parameters": {item.name: _parameter(item) for item in fit.parameters},
    }


def _parameter(item: StoredParameter) -> Mapping[str, Any]:
    return {
        "value": item.value,
        "unit": item.unit,
        "std_error": item.std_error,
        "interval95": None if item.low is None or item.high is None else [item.low, item.high],
        "verdict": item.verdict,
    }

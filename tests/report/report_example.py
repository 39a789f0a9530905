"""A result as identify writes it, of a machine that never was: three recordings, two channels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.report import write_report

Result = dict[str, Any]
Series = dict[str, dict[str, dict[str, np.ndarray]]]

CHANNELS = {"motor_position": "rad", "load_acceleration": "rad/s^2"}
NOISE = {"motor_position": 2.0e-3, "load_acceleration": 4.0e-3}
SPIKE = 7.5
"""A single sample of a long recording."""
QUESTION = """Azimuth axis of a radio telescope, 70 m dish, one of two identical drive chains.
Known: motor inertia 0.002 kg m^2, ratio 15050, half of the structure 58355.5 kg m^2.
Asked: Coulomb and viscous friction on both sides, stiffness and damping of the gearbox."""


def parameter(
    value: float, unit: str, std_error: float | None, guess: float, verdict: str = "ok", traded: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Return an entry of the parameter table, with a normal interval."""
    interval = None if std_error is None else [value - 1.96 * std_error, value + 1.96 * std_error]
    return {
        "value": value,
        "unit": unit,
        "std_error": std_error,
        "interval95": interval,
        "guess": guess,
        "verdict": verdict,
        "traded_with": list(traded),
    }


def parameters() -> dict[str, Any]:
    """Return nine estimates, one of every verdict among them."""
    return {
        "motor.friction.tau_c": parameter(0.11023, "N m", 0.00104, 0.1),
        "motor.friction.tau_s": parameter(0.1874, "N m", 0.0061, 0.15),
        "motor.friction.omega_s": parameter(4.312, "rad/s", 0.41, 3.0),
        "motor.friction.viscous": parameter(0.000412, "N m s/rad", 0.0000063, 0.0005),
        "load.friction.tau_c.positive": parameter(
            512.0, "N m", 160.0, 500.0, "traded", ("load.friction.tau_c.negative",)
        ),
        "load.friction.tau_c.negative": parameter(
            481.0, "N m", 171.0, 500.0, "traded", ("load.friction.tau_c.positive",)
        ),
        "load.friction.viscous": parameter(0.0, "N m s/rad", None, 6.0e4, "at_bound"),
        "motor-load.stiffness": parameter(8.9712e7, "N m/rad", 2.1e5, 8.5e7),
        "motor-load.damping": parameter(1.21e5, "N m s/rad", 4.0e5, 1.0e5, "not_identifiable"),
    }


def series(samples: int = 12000, seed: int = 3) -> Series:
    """Return three recordings: a staircase, a stop with a gap in the data, and reversals."""
    random = np.random.default_rng(seed)
    result: Series = {}
    for index, name in enumerate(("staircase.h5", "stop.h5", "reversals.h5")):
        time = np.linspace(0.0, 60.0, samples)
        speed = (20.0 * np.floor(time / 10.0 + 1.0), 60.0 - time, 40.0 * np.sin(0.4 * time))[index]
        position = np.cumsum(speed) * (time[1] - time[0])
        truth = {"motor_position": position, "load_acceleration": np.gradient(np.tanh(speed / 20.0), time)}
        result[name] = {}
        for channel, values in truth.items():
            misfit = 20.0 * NOISE[channel] * np.sin(0.9 * time + index) * (channel == "motor_position")
            measured = values + NOISE[channel] * random.standard_normal(samples)
            if index == 1:
                measured[samples // 3 : samples // 3 + samples // 12] = np.nan
            result[name][channel] = {"time": time, "measured": measured, "simulated": values + misfit}
    return result


def fit_of(names: list[str], of: Series) -> dict[str, Any]:
    """Return the fit of some recordings, per channel."""
    fit: dict[str, Any] = {}
    for channel, unit in CHANNELS.items():
        error = np.concatenate([of[name][channel]["measured"] - of[name][channel]["simulated"] for name in names])
        signal = np.concatenate([of[name][channel]["measured"] for name in names])
        rms = float(np.sqrt(np.nanmean(error**2)))
        fit[channel] = {
            "rms": rms,
            "mae": float(np.nanmean(np.abs(error))),
            "unit": unit,
            "relative": rms / float(np.nanstd(signal)),
            "relative_norm": rms / float(np.sqrt(np.nanmean(signal**2))),
            "noise_ratio": rms / NOISE[channel],
            "noise_source": "noise_std",
            "by_recording": {name: {"rms": rms, "mae": 0.8 * rms} for name in names},
        }
    return fit


def friction_curves() -> list[dict[str, Any]]:
    """Return Stribeck curves of the motor at two loads and a Coulomb line of the load."""
    speed = np.concatenate([-np.geomspace(120.0, 1e-3, 120), np.geomspace(1e-3, 120.0, 120)])
    curves: list[dict[str, Any]] = []
    for shaft, law, load, scale in (
        ("motor", "stribeck", 0.0, 1.0),
        ("motor", "stribeck", 20.0, 1.25),
        ("load", "coulomb_viscous", 0.0, 4500.0),
    ):
        weakening = 0.077 * np.exp(-((speed / 4.3) ** 2)) if law == "stribeck" else 0.0
        torque = scale * (np.sign(speed) * (0.11 + weakening) + 0.0004 * speed)
        width = scale * (0.004 + 0.00005 * np.abs(speed))
        values = {"torque": torque, "lower": torque - width, "upper": torque + width}
        curves.append(
            {"shaft": shaft, "law": law, "load": load, "load_unit": "N m", "speed": speed.tolist()}
            | {key: column.tolist() for key, column in values.items()}
            | {"speed_unit": "rad/s", "torque_unit": "N m"}
        )
    return curves


def residuals(names: list[str]) -> dict[str, Any]:
    """Return autocorrelations: the position's residual is not white, the acceleration's is."""
    lag = np.linspace(0.0, 5.0, 200)
    shapes = {"motor_position": np.exp(-lag / 2.0) * np.cos(0.9 * lag), "load_acceleration": 0.03 * np.sin(40.0 * lag)}
    shapes["load_acceleration"][0] = 1.0
    return {
        name: {
            channel: {
                "lag_s": lag.tolist(),
                "autocorrelation": shape.tolist(),
                "band": 0.05,
                "white": channel == "load_acceleration",
            }
            for channel, shape in shapes.items()
        }
        for name in names
    }


def coherence(names: list[str]) -> dict[str, Any]:
    """Return coherences that fall where noise takes over."""
    frequency = np.geomspace(0.05, 100.0, 120)
    share = {"motor_position": 1.0 / (1.0 + (frequency / 3.0) ** 4), "load_acceleration": np.exp(-frequency / 30.0)}
    return {
        name: {
            channel: {"frequency_hz": frequency.tolist(), "share": values.tolist(), "explained": float(values[20])}
            for channel, values in share.items()
        }
        for name in names
    }


def correlation(names: list[str], seed: int = 5) -> dict[str, Any]:
    """Return a matrix in which two of the parameters trade."""
    random = np.random.default_rng(seed)
    matrix = np.clip(0.25 * random.standard_normal((len(names), len(names))), -0.8, 0.8)
    matrix = np.tril(matrix, -1)
    matrix[5, 4] = -0.991
    matrix = matrix + matrix.T + np.eye(len(names))
    return {"names": names, "matrix": matrix.tolist()}


def identified(samples: int = 12000) -> tuple[Result, Series]:
    """Return a converged result with its series."""
    shown = series(samples)
    train, validation = ["staircase.h5", "stop.h5"], ["reversals.h5"]
    result: Result = {
        "format": "friction-ocp-result/1",
        "title": "Azimuth axis of a radio telescope, Stribeck friction on the fast side",
        "question": QUESTION,
        "problem": "azimuth.yaml",
        "recordings": {"train": train, "validation": validation},
        "status": "converged",
        "message": "gradient 3.1e-09 below tolerance 1.0e-08",
        "warnings": [
            "load.friction.viscous = 0 N m s/rad stands at its lower bound; its interval is one-sided, and the "
            "load side may need another law.",
            "load.friction.tau_c.positive and load.friction.tau_c.negative are traded (correlation -0.991): the "
            "recordings fix their sum, not each of them. Record both directions at equal speed.",
            "motor_position: the residual is 14 times the noise floor and not white; standard errors are the robust "
            "ones. Run friction-ocp diagnose.",
        ],
        "parameters": parameters(),
        "fit": {"horizon_s": 10.0, "train": fit_of(train, shown), "validation": fit_of(validation, shown)},
        "channel_units": dict(CHANNELS),
        "correlation": correlation(list(parameters())),
        "friction_curves": friction_curves(),
        "residuals": residuals([*train, *validation]),
        "coherence": coherence([*train, *validation]),
        "solver": {
            "name": "gauss_newton",
            "iterations": 9,
            "seconds": 0.8123,
            "build_seconds": 1.1,
            "objective": 1234.5678,
            "starts": 1,
        },
        "provenance": {
            "friction_ocp": "0.1.0",
            "python": "3.11.2",
            "created": "2025-11-21T11:31:00+00:00",
            "recordings": {name: f"{index}" * 64 for index, name in enumerate((*train, *validation))},
        },
    }
    return result, shown


def write_long_report(folder: Path, samples: int = 1_000_000) -> Path:
    """Write the report of a long recording with one sample that stands out."""
    result, shown = identified(2000)
    time = np.arange(samples) * 1e-3
    measured = np.sin(0.05 * time)
    measured[(2 * samples) // 3] = SPIKE
    columns = {"time": time, "measured": measured, "simulated": np.sin(0.05 * time)}
    (name, *_), channel = result["recordings"]["train"], "motor_position"
    series: Any = {**shown, name: {**shown[name], channel: columns}}
    write_report(result, series, folder / "report.html")
    return folder / "report.html"

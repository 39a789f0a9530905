"""What the identified model makes of the slow run under the loop and of the presliding loop, beside the plant.

The limit cycle at 1.11e-4 rad/s (Fig. 3, top) has a period and an rms speed, the loop of torque over angle (Fig. 7) an
area. The gains of the speed loop are those of limit_cycle.yaml: kp 2e5 N m s/rad, ki 4e6 N m/rad at 5 ms.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from friction_ocp.estimation.estimate import simulate
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.element import FrictionElement
from friction_ocp.parameters import Directional
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.recording import Recording

HERE = Path(__file__).resolve().parent
SMOOTHED = 5
"""Samples of the 10 ms log over which a speed is averaged."""
LAST_TURN = 8.0
"""s; period of the ramps of the presliding loop, whose last one is judged: the first starts from a slack bristle."""
BLOCK = 20
"""Samples of the 1 ms log that are averaged for the area."""
Numbers = Mapping[str, float]


def repeated(found: Mapping[str, Numbers], recordings: Mapping[str, Recording]) -> dict[str, dict[str, list[float]]]:
    """Return [measured, simulated] period, rms speed and area, by recording.

    `found` holds the answers of the joint problems by direction: values by parameter name.
    """
    told: dict[str, dict[str, list[float]]] = {}
    for direction in found:
        name = f"slow_{direction}"
        one = dict.fromkeys(found, found[direction])
        runs = [cycle_of(*run) for run in _runs(with_numbers("limit_cycle", one, recordings[name]))]
        told[name] = {key: [run[k] for run in runs] for k, key in enumerate(("period", "rms_speed"))}
    told["hysteresis"] = {"area": areas(with_numbers("hysteresis", found, recordings["hysteresis"]))}
    return told


def with_numbers(name: str, found: Mapping[str, Numbers], recording: Recording) -> Problem:
    """Return a problem with identified numbers of both directions in place of those in its file."""
    problem = load_problem(HERE / f"{name}.yaml")
    sides = {
        path.rpartition(".")[2]: Directional(value, found["west_east"][path])
        for path, value in found["east_west"].items()
        if path.startswith("axis.friction.")
    }
    inertia = float(np.mean([numbers["axis.inertia"] for numbers in found.values()]))
    (axis,) = problem.drive.shafts
    axis = replace(axis, inertia=inertia, friction=FrictionElement(LuGre(**sides)))
    return replace(
        problem, drive=replace(problem.drive, shafts=(axis,)), train=(RecordingUse(recording),), validation=()
    )


def _runs(problem: Problem) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return time and angle, as measured and as simulated."""
    run = simulate(problem).train[0]
    logged = np.isfinite(run.measured[:, 0])
    return [(run.time[logged], values[logged, 0]) for values in (run.measured, run.simulated)]


def cycle_of(time: np.ndarray, position: np.ndarray) -> tuple[float, float]:
    """Return period and rms speed of a stick-slip motion, from its slips in the second half."""
    late = time > 0.5 * time[-1]
    t, speed = time[late][1:], np.abs(np.diff(position[late]) / np.diff(time[late]))
    smooth = np.convolve(speed, np.ones(SMOOTHED) / SMOOTHED, "same")
    high = smooth > 0.5 * np.max(smooth)
    begins = t[1:][high[1:] & ~high[:-1]]
    return float(np.mean(np.diff(begins))), float(np.sqrt(np.mean(smooth**2)))


def areas(problem: Problem) -> list[float]:
    """Return the area of the last turn of torque over angle, N m rad, as measured and as simulated."""
    torque = problem.train[0].recording.channels["torque"]
    return [loop_area(time, position, np.interp(time, torque.time, torque.values)) for time, position in _runs(problem)]


def loop_area(time: np.ndarray, position: np.ndarray, torque: np.ndarray) -> float:
    """Return the area inside torque over angle, both averaged over blocks against their noise."""
    last = time > time[-1] - LAST_TURN
    count = last.sum() // BLOCK * BLOCK
    angle, level = (values[last][-count:].reshape(-1, BLOCK).mean(axis=1) for values in (position, torque))
    return float(abs(np.sum(0.5 * (level + np.roll(level, -1)) * (np.roll(angle, -1) - angle))))

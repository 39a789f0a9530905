"""Make data/aries: the R.A. axis of the ARIES Schmidt telescope as the plant of the tests has it, from its paper.

python problems/aries/make_data.py [--seed 1] [--only PART]. Torque noise 1 N m, encoder 0.05 arcsec. The speed loop is
an incremental PI at 5 ms with the gains of tests/aries.py. Parts:

curve: 30 speeds x 5 positions x 4 passes x 2 directions under the loop, 10 ms logs, averaged over the second half of a
run. A run whose speed swings by more than a fifth of its mean is a limit cycle, and so is one slower than five counts
of the loop's encoder in a sample: the loop then hunts from count to count, faster than the noisy log shows.
`curve_<direction>.h5` leaves these out, `curve_all_<direction>.h5` averages them too, as the paper does.
places: mean torque at two speeds and 41 positions, both directions, on an axis whose dry friction has a wave over one
turn of the friction roller. dwell: torque at which slow ramps break away, after rests of 1 s to 1000 s.
responses: torque steps and a slow ramp at 1 ms, a step logged at 10 ms, a slow loop below breakaway, and speed runs.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))

import aries  # noqa: E402
from plant import Plant, PlantFriction, PlantRipple, Trajectory  # noqa: E402

from friction_ocp.recording.hdf5 import write_recording, write_static_points  # noqa: E402
from friction_ocp.recording.recording import Channel, Recording  # noqa: E402
from friction_ocp.recording.static_points import StaticPoints  # noqa: E402

DIRECTIONS = {"east_west": 1.0, "west_east": -1.0}
SPEEDS = np.geomspace(1.11e-5, 4.45e-2, 30)
POSITIONS = np.radians([0.0, 30.0, 60.0, -30.0, -60.0])
PASSES, SLOW_LOG, FAST_LOG = 4, 1e-2, 1e-3
SWING = 0.2
"""Deviation of the speed over its mean from which a run is a limit cycle."""
SPEED_NOISE = 0.05
"""Noise of the speed over its mean that the angle is averaged down to, to see the swing."""
EVEN_SPEEDS, PLACES = (1.2e-2, 2.4e-2), np.radians(np.linspace(-60.0, 60.0, 41))
"""rad/s beyond the Stribeck part, and rad."""
HELD = 0.25
"""s that a run is averaged over at a place: it moves by less than a fortieth of the wave."""
ROLLER, WAVE = 2.0 * np.pi / 24.5, (0.04, -0.025)
"""Turn of the friction roller on the axis, rad; cosine and sine of the wave over it in the dry friction."""
RESTS, LONG_REST, AGEING = (1.0, 10.0, 100.0, 1000.0), 100.0, 0.05
"""s at rest before a ramp, the rest for which T_S is that of Table 1, and by how much of it T_S grows in a decade."""
RAMP_FROM, RAMP_RATE, MOVED = 1000.0, 10.0, 1e-4
"""N m and N m/s of the ramp, and rad after which an axis has broken away."""
SOURCE = "problems/aries/make_data.py"


def run_time(speed: float) -> float:
    """Return how long a speed is held, s: at least three times what the integral part takes to break away."""
    return float(np.clip(3.0 * aries.NUMBERS["tau_s"][0] / (aries.KI * speed), 10.0, 120.0))


def held_speed(
    speed: float, position: float, rng: np.random.Generator, scale: float = 1.0
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the log of one pass at a commanded speed."""
    start = {"axis.theta": position, "axis.omega": 0.0}
    plant = aries.axis(SLOW_LOG, scale=scale)
    return plant.simulate(
        run_time(abs(speed)), {"reference.omega": speed}, rng, step=aries.PLANT_STEP, initial=start
    ).channels


def averages(log: dict[str, tuple[np.ndarray, np.ndarray]]) -> tuple[float, float, float]:
    """Return mean speed and mean torque of the second half of a log, and the swing of its speed over the mean.

    The swing is at least the quantum of the loop's speed, one count in a sample, over the mean: friction that is convex
    over the speed is not the mean torque of such a run.
    """
    time, position = log["position"]
    late = time > 0.5 * time[-1]
    mean_speed = abs(position[late][-1] - position[late][0]) / (time[late][-1] - time[late][0])
    noise = np.sqrt(2.0) * aries.LOG_NOISE / (SPEED_NOISE * SLOW_LOG * max(mean_speed, 1e-6))
    block = int(np.clip(np.ceil(noise ** (2.0 / 3.0)), 2, 100))
    angle = position[late][: late.sum() // block * block].reshape(-1, block).mean(axis=1)
    speeds = np.diff(angle) / (block * SLOW_LOG)
    mean = float(np.mean(speeds))
    swing = max(float(np.std(speeds)), aries.LOOP_STEP / aries.SAMPLE_TIME) / max(abs(mean), 1e-12)
    return mean, float(np.mean(log["torque"][1][late])), swing


def curves(seed: int) -> dict[str, StaticPoints]:
    """Return the averaged torque over speed of both directions, without and with limit cycles."""
    found: dict[str, StaticPoints] = {}
    for k, (direction, sign) in enumerate(DIRECTIONS.items()):
        rng = np.random.default_rng([seed, k])
        rows = []
        for speed in SPEEDS:
            runs = [averages(held_speed(sign * speed, place, rng)) for place in POSITIONS for _ in range(PASSES)]
            mean, torque, swing = np.array(runs).T
            error = np.std(torque, ddof=1) / np.sqrt(len(runs))
            rows.append((np.mean(mean), np.mean(torque), error, len(runs), np.median(swing), sign * speed))
        table = np.array(rows)
        smooth = table[:, 4] < SWING
        for name, keep in (("curve", smooth), ("curve_all", np.ones_like(smooth))):
            speed = table[keep, 0] if name == "curve" else table[keep, 5]
            found[f"{name}_{direction}"] = StaticPoints(
                f"{name}_{direction}",
                speed,
                {"speed": "rad/s", "torque": "N m", "std_error": "N m", "runs": "1"},
                torque=table[keep, 1],
                std_error=table[keep, 2],
                runs=table[keep, 3],
                title=f"ARIES Schmidt telescope, mean torque at held speeds, {direction}, simulated",
                source=f"{SOURCE}, seed {seed}",
                licence="MIT",
            )
    return found


def recording(name: str, title: str, seed: int, channels: dict[str, tuple[np.ndarray, np.ndarray, str]]) -> Recording:
    """Return a recording of channels (time, values, unit), each of its own clock where the times differ."""
    first = next(iter(channels.values()))[0]
    made = {
        key: Channel(key, time, values, unit, "time" if time is first else key)
        for key, (time, values, unit) in channels.items()
    }
    text = f"ARIES Schmidt telescope, {title}, simulated"
    return Recording(name, made, title=text, source=f"{SOURCE}, seed {seed}", licence="MIT")


def places(seed: int) -> dict[str, StaticPoints]:
    """Return the mean torque over position of an axis with a wave in its dry friction, both directions in one."""
    rng = np.random.default_rng([seed, 3])
    plain = aries.axis(SLOW_LOG)
    plant = replace(plain, shafts=(replace(plain.shafts[0], ripple=PlantRipple(ROLLER, *WAVE)),))
    rows = []
    for speed in (sign * size for sign in DIRECTIONS.values() for size in EVEN_SPEEDS):
        for place in PLACES:
            start = {"axis.theta": place, "axis.omega": speed}
            logs = [
                plant.simulate(2.0, {"reference.omega": speed}, rng, step=aries.PLANT_STEP, initial=start).channels
                for _ in range(PASSES)
            ]
            late = logs[0]["position"][0] > 2.0 - HELD
            torque = [np.mean(log["torque"][1][late]) for log in logs]
            rows.append((speed, np.mean(torque), np.mean(logs[0]["position"][1][late]), np.var(torque, ddof=1)))
    speed, torque, position, variance = np.array(rows).T
    error = np.sqrt(np.mean(variance) / PASSES)
    points = StaticPoints(
        "places",
        speed,
        {"speed": "rad/s", "torque": "N m", "std_error": "N m", "position": "rad", "runs": "1"},
        torque=torque,
        std_error=np.full(speed.size, error),
        position=position,
        runs=np.full(speed.size, float(PASSES)),
        title="ARIES Schmidt telescope, mean torque over position, simulated",
        source=f"{SOURCE}, seed {seed}",
        licence="MIT",
    )
    return {points.name: points}


def dwells(seed: int) -> dict[str, StaticPoints]:
    """Return the torque at which slow ramps break away, after rests of different length, in both directions."""
    found: dict[str, StaticPoints] = {}
    for rest in RESTS:
        numbers = dict(aries.NUMBERS)
        numbers["tau_s"] = tuple(value * (1.0 + AGEING * np.log10(rest / LONG_REST)) for value in numbers["tau_s"])
        plain = aries.axis(SLOW_LOG, looped=False)
        friction = PlantFriction("lugre", delta=aries.DELTA, **numbers)
        plant = replace(plain, shafts=(replace(plain.shafts[0], friction=friction),))
        name, rng = f"dwell_{rest:g}", np.random.default_rng([seed, 5, int(rest)])
        rows = [(sign, breakaway(plant, sign, rng)) for sign in DIRECTIONS.values() for _ in range(PASSES)]
        direction, torque = np.array(rows).T
        spread = np.mean([np.std(torque[direction == sign], ddof=1) for sign in DIRECTIONS.values()])
        found[name] = StaticPoints(
            name,
            np.zeros(torque.size),
            {"speed": "rad/s", "torque": "N m", "std_error": "N m", "direction": "1"},
            torque=torque,
            std_error=np.full(torque.size, spread),
            direction=direction,
            title=f"ARIES Schmidt telescope, breakaway after a rest of {rest:g} s, simulated",
            source=f"{SOURCE}, seed {seed}",
            licence="MIT",
        )
    return found


def breakaway(plant: Plant, sign: float, rng: np.random.Generator) -> float:
    """Return the size of the torque, on a slow ramp, at which an axis has moved by MOVED."""
    end = (1700.0 - RAMP_FROM) / RAMP_RATE
    ramp = corners((0.0, 0.0), (2.0, sign * RAMP_FROM), (2.0 + end, sign * 1700.0))
    log = plant.simulate(2.0 + end, {"motor.torque": ramp}, rng, step=2e-5).channels
    moved = np.abs(log["position"][1]) > MOVED
    return float(np.abs(log["torque"][1][np.argmax(moved)]))


def open_loop(name: str, title: str, seed: int, torque: Trajectory, period: float) -> Recording:
    """Return position and torque under a commanded torque, from rest with a slack bristle."""
    rng = np.random.default_rng([seed, sum(name.encode())])
    plant = aries.axis(period, looped=False)
    log = plant.simulate(float(torque.time[-1]), {"motor.torque": torque}, rng, step=2e-5).channels
    return recording(name, title, seed, {"position": (*log["position"], "rad"), "torque": (*log["torque"], "N m")})


def closed_loop(name: str, title: str, seed: int, speed: Trajectory, period: float = SLOW_LOG) -> Recording:
    """Return position, torque and reference while the loop follows a speed."""
    rng = np.random.default_rng([seed, sum(name.encode())])
    log = (
        aries.axis(period)
        .simulate(float(speed.time[-1]), {"reference.omega": speed}, rng, step=aries.PLANT_STEP)
        .channels
    )
    grid = log["position"][0]
    return recording(
        name,
        title,
        seed,
        {
            "position": (*log["position"], "rad"),
            "torque": (grid, log["torque"][1], "N m"),
            "reference": (grid, speed.at(grid), "rad/s"),
        },
    )


def steps(sign: float, low: float, high: float, rng: np.random.Generator, seconds: float = 6.0) -> Trajectory:
    """Return torque steps between two levels below breakaway, held 30 to 90 ms each."""
    edges = np.cumsum(rng.uniform(0.03, 0.09, int(seconds / 0.06)))
    edges = np.round(np.concatenate(([0.0, 0.1], 0.1 + edges)), 3)
    levels = sign * np.concatenate(([0.0], np.where(np.arange(edges.size - 1) % 2, low, high)))
    return Trajectory(edges, levels, "zero")


def corners(*pairs: tuple[float, float]) -> Trajectory:
    """Return straight lines through (time, value)."""
    time, value = np.array(pairs).T
    return Trajectory(time, value, "linear")


def responses(seed: int) -> list[Recording]:
    """Return the dynamic recordings."""
    made: list[Recording] = []
    for k, (direction, sign) in enumerate(DIRECTIONS.items()):
        rng = np.random.default_rng([seed, 77, k])
        presliding = steps(sign, 100.0, 400.0, rng)
        made.append(open_loop(f"steps_{direction}", "small torque steps", seed, presliding, FAST_LOG))
        again = steps(sign, 100.0, 400.0, rng)
        made.append(open_loop(f"steps_again_{direction}", "small torque steps", seed, again, FAST_LOG))
        small = steps(sign, 0.0, 50.0, rng)
        made.append(open_loop(f"small_steps_{direction}", "torque steps of 50 N m", seed, small, FAST_LOG))
        made.append(open_loop(f"coarse_{direction}", "small torque steps logged at 10 ms", seed, presliding, SLOW_LOG))
        ramp = corners((0.0, 0.0), (16.2, sign * 1620.0))
        made.append(open_loop(f"ramp_{direction}", "slow torque ramp to breakaway", seed, ramp, FAST_LOG))
        moves = corners(
            (0.0, 0.0),
            (2.0, sign * 4e-3),
            (6.0, sign * 4e-3),
            (9.0, sign * 4e-2),
            (12.0, sign * 4e-2),
            (16.0, sign * 1.5e-3),
            (20.0, sign * 1.5e-3),
        )
        made.append(closed_loop(f"moves_{direction}", "speed profile under the loop", seed, moves, FAST_LOG))
        for name, speed in (("slow", 1.11e-4), ("fast", 3.90e-2)):
            level = corners((0.0, 0.0), (0.1, sign * speed), (20.0, sign * speed))
            made.append(closed_loop(f"{name}_{direction}", f"{speed:g} rad/s under the loop", seed, level))
    turns = [(0.0, 0.0)] + [(2.0 + 4.0 * k, 600.0 * (-1.0) ** k) for k in range(5)]
    made.append(open_loop("hysteresis", "torque up and down below breakaway", seed, corners(*turns), FAST_LOG))
    sidereal = corners((0.0, 0.0), (0.1, 15.0 * aries.ARCSEC), (60.0, 15.0 * aries.ARCSEC))
    made.append(closed_loop("sidereal", "15 arcsec/s under the loop", seed, sidereal))
    return made


def main() -> None:
    """Write all parts, or one of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parts: dict[str, Callable[[int, Path], None]] = {
        "curve": lambda seed, folder: _write_points(curves(seed), folder),
        "places": lambda seed, folder: _write_points(places(seed), folder),
        "dwell": lambda seed, folder: _write_points(dwells(seed), folder),
        "responses": lambda seed, folder: _write_recordings(responses(seed), folder),
    }
    parser.add_argument("--only", choices=parts, default=None)
    asked = parser.parse_args()
    folder = ROOT / "data" / "aries"
    folder.mkdir(parents=True, exist_ok=True)
    for name, write in parts.items():
        if asked.only in (None, name):
            write(asked.seed, folder)


def _write_points(made: dict[str, StaticPoints], folder: Path) -> None:
    for name, points in made.items():
        write_static_points(points, folder / f"{name}.h5")


def _write_recordings(made: list[Recording], folder: Path) -> None:
    for item in made:
        write_recording(item, folder / f"{item.name}.h5")


if __name__ == "__main__":
    main()

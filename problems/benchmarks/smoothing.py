"""Does the answer depend on how the sign of the speed is smoothed? A slow axis with Coulomb friction, from the plant.

python problems/benchmarks/smoothing.py [--seed 5]

A sine of 20 rad/s at 0.2 Hz, then 3 rad/s constant: sticking at every reversal. `identify` ends with exact, set-valued
friction; the table fits the same free run with smoothed friction and shows how far each estimate is from the exact one,
in standard errors, and what of the residuals' whiteness is left.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

from checks import Check, print_rows, tell_status
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory

from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Drive, Motor, Shaft
from friction_ocp.estimation.estimate import Estimate, identify
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.horizon import horizon
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.problem import EstimationOptions, Problem, RecordingUse
from friction_ocp.estimation.stages import free_run
from friction_ocp.estimation.whiteness import whiteness
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording
from friction_ocp.simulation.losses import Squares

TORQUE_CONSTANT, INERTIA, COULOMB, VISCOUS = 0.35, 0.002, 0.1, 1.5e-3
SLOW_SINE, FREQUENCY, CREEP = 20.0, 0.2, 3.0
SINE_SECONDS, RAMP, SECONDS, RATE, NOISE = 10.0, 0.2, 15.0, 500.0, 1.0e-2
WIDTHS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 0.0)
"""Smoothing of the sign over the typical speed."""


TIGHT = Tolerances(decrease=1e-12, negligible=1e-6, progress=1e-10, stalled=1e-6)
"""Far below a tenth of a standard error: what moves then moves by the smoothing."""


@dataclass(frozen=True)
class Smoothed:
    """A fit with one smoothing width."""

    width: float
    theta: np.ndarray
    p_value: float


def slow_current() -> Trajectory:
    """Return the current that takes the axis through the motion, were it without noise."""
    time = np.arange(0.0, SECONDS, 1.0 / RATE)
    sine = SLOW_SINE * np.sin(2 * np.pi * FREQUENCY * time)
    creep = CREEP * np.clip((time - SINE_SECONDS) / RAMP, 0.0, 1.0)
    speed = np.where(time < SINE_SECONDS, sine, creep)
    torque = INERTIA * np.gradient(speed, time) + COULOMB * np.sign(speed) + VISCOUS * speed
    return Trajectory(time, torque / TORQUE_CONSTANT, "zero")


def slow_run(seed: int) -> Recording:
    """Return what the plant's encoder shows of that motion."""
    rng, current = np.random.default_rng(seed), slow_current()
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS)),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(PlantSensor("position", "motor.theta", period=1 / RATE, noise_std=NOISE),),
    )
    log = plant.simulate(SECONDS, {"drive.current": current}, rng)
    channels = {
        "position": Channel("position", *log.channels["position"], "rad"),
        "current": Channel("current", np.asarray(current.time), np.asarray(current.value), "A"),
    }
    return Recording("slow", channels)


def slow_problem(seed: int) -> Problem:
    """Return the problem of finding inertia and friction from guesses that are well off."""
    law = CoulombViscous(Free(0.07, 0.0, 2.0), Free(2.2e-3, 0.0, 0.03))
    shaft = Shaft("motor", Free(0.003, 1e-4, 0.04), FrictionElement(law))
    channels = (
        Sensor("current", "drive.current", role="input", hold="zero"),
        Sensor("position", "motor.theta", noise_std=NOISE),
    )
    drive = Drive((shaft,), (), (Motor("drive", "motor", TORQUE_CONSTANT),), None, channels)
    options = EstimationOptions(fit="simulation", horizon_s=SECONDS)
    return Problem("slow axis", drive, (RecordingUse(slow_run(seed)),), estimation=options)


def smoothed(problem: Problem, answer: Estimate) -> list[Smoothed]:
    """Fit the free run of a problem with every width, each from the exact answer."""
    model = prepare(problem)
    theta = np.array([item.value for item in answer.parameters])
    found: list[Smoothed] = []
    for width in WIDTHS:
        program = free_run(model, model.train, width, Squares(), horizon(model))
        end = solve_gauss_newton(program, suggested_point(program, theta), TIGHT).point
        residual = program.residuals(0, program.simulate(0, end).y)[:, 0]
        seen = np.isfinite(residual)
        found.append(Smoothed(width, end.theta, whiteness(model.train[0].grid.time[seen], residual[seen]).p_value))
    return found


def main() -> int:
    """Print the table; 1 where the answer moves or residuals of the correct model look coloured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=5)
    problem = slow_problem(parser.parse_args().seed)
    answer = identify(problem)
    table = smoothed(problem, answer)
    errors = np.array([item.std_error for item in answer.parameters])
    exact = table[-1].theta
    rows = [
        [f"{item.width:g}", *(f"{shift:+.3f}" for shift in (item.theta - exact) / errors), f"{item.p_value:.3f}"]
        for item in table
    ]
    print_rows(["width", *(f"{item.name}" for item in answer.parameters), "whiteness p"], rows)
    moved = float(np.max(np.abs(table[-2].theta - exact) / errors))
    tests = [test for by_channel in answer.residuals.values() for test in by_channel.values()]
    return tell_status(
        [
            Check("the estimate moves by less than a tenth of a standard error", f"{moved:.4f}", moved < 0.1),
            Check("residuals are white", f"p {min(test.p_value for test in tests):.3f}", all(t.white for t in tests)),
        ]
    )


if __name__ == "__main__":
    raise SystemExit(main())

"""Fits with the noise of measured inputs as unknowns, from fits on segments that it joins as torque noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from friction_ocp.estimation.gauss_newton import Solution, solve_gauss_newton
from friction_ocp.estimation.model import Model, laid_for
from friction_ocp.estimation.node_ends import WARM, begun
from friction_ocp.estimation.program import Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.rough_bowl import stepped_out, unstuck
from friction_ocp.estimation.rounds import Fitted, final_solver, limits
from friction_ocp.estimation.stages import is_noise
from friction_ocp.estimation.unknown_noise import telling_program
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares


def with_told_noise(model: Model, joined: Fitted, phases: Phases) -> tuple[Model, Fitted] | None:
    """Return model and fit with the noise of its noisy inputs as unknowns; None where that leaves more than noise.

    From where a fit on `joined` segments stands, which noise may have drawn far from the truth, and from the guesses.
    What misses much would call that noise.
    """
    found = dict(zip(model.space.names, map(float, joined.solution.point.theta), strict=True))
    telling = replace(laid_for(model, found), tells_noise=True)
    program = telling_program(telling, 0.0, Squares())
    end = _followed(telling, program, [joined.solution.point.theta, model.space.guess], phases)
    end = replace(end, iterations=end.iterations + joined.solution.iterations)
    return (telling, Fitted(end, program)) if is_noise(program, end) else None


def _followed(model: Model, program: Program, starts: Sequence[FloatArray], phases: Phases) -> Solution:
    """Return the best end that is found from some parameters."""
    watch = phases.begin("noise of every sample")
    ends = [solve_gauss_newton(program, begun(program, theta), WARM, watch) for theta in starts]
    point = min((unstuck(model, program, end.point, watch) for end in ends), key=program.objective)
    watch = phases.begin("noise of every sample, steps of standard errors")
    point = stepped_out(model, program, point, watch)
    last = final_solver(model)(program, point, limits(model), watch)
    return replace(last, iterations=last.iterations + sum(end.iterations for end in ends))

"""A fit from start to end: from every start the way that suits the drive, and the best end."""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.estimation.curriculum import may_be_cut
from friction_ocp.estimation.detours import detour, hop
from friction_ocp.estimation.division import are_alike, divided_afresh, moved_share, reweighed
from friction_ocp.estimation.gap import following
from friction_ocp.estimation.growth import drifting
from friction_ocp.estimation.horizon import fits_free_run, horizon, is_held, longest_recording
from friction_ocp.estimation.kept_loss import fit_kept
from friction_ocp.estimation.model import Model, laid_for, late_of, with_late
from friction_ocp.estimation.noise_level import most_likely, with_levels
from friction_ocp.estimation.points_fit import fit_points
from friction_ocp.estimation.preparation import is_moved_by_inputs, joined_by_input_noise, may_leave_free_runs
from friction_ocp.estimation.progress import Phases, Progress, silent
from friction_ocp.estimation.refinement import refined
from friction_ocp.estimation.release import within_reach
from friction_ocp.estimation.rounds import Fitted, Plan, final_solver, joined, limits, staged, windowed
from friction_ocp.estimation.short_cut import through_short_segments
from friction_ocp.estimation.stages import WIDTHS, is_noise, keeps_the_loss
from friction_ocp.estimation.starts import start_points
from friction_ocp.estimation.synchronise import moves_of, synchronised, with_moves
from friction_ocp.estimation.told_noise import with_told_noise
from friction_ocp.simulation.losses import Squares

EXPECTED_PHASES = 16
MOST_TURNS = 10
CUTS = 2
"""Turns in which segments are cut where differences grow along what was found; later ones keep them as long as they
are nearly where they would be cut afresh, or would be cut as they were before."""
SETTLED = 0.01
"""Relative change of the size of a gap, as inertias, stiffnesses and torque noise are found, below which none moves;
and share of the cuts that may be elsewhere than where they belong."""


def fit(model: Model, progress: Progress = silent) -> Fitted:
    """Fit the parameters of a problem from its guesses.

    A drive that something holds is fitted on its free run at once. One that drifts is fitted on free runs over growing
    windows, where free runs are asked for: from short predictions and, unless that ends at the noise and the friction
    has no part that is hard to start, from the best ends of a fit on relaxed segments. Only free runs are long enough
    for kinks of the friction to trap them. All starts have the gaps of the guesses, lest the one with the widest wins.
    """
    options = model.problem.estimation
    phases = Phases(progress, EXPECTED_PHASES * options.starts)
    if not model.train:
        return Fitted(*fit_points(model, phases.begin("static points")))
    starts = [within_reach(model, start) for start in start_points(model.space, options.starts, options.seed)]
    laid = replace(model, found=dict(zip(model.space.names, map(float, model.nominal), strict=True)))
    models = [replace(laid, space=model.space.moved(start)) for start in starts]
    best = min((_fit_once(item, phases) for item in models), key=lambda fitted: fitted.solution.objective)
    return detour(model, best, phases) if fits_free_run(model) else best


def settled(model: Model, progress: Progress = silent) -> tuple[Model, Fitted]:
    """Fit, with clocks and torque noise where they are asked for, then shorten the integrator's steps where it matters.

    Noise of measured inputs that rules is told sample by sample; it joins segments where these leave more than noise
    without it, and no more with it. Return the model with these stamps, levels and steps.
    Shorter steps move the kinks of exact friction, and what was the best end between them need not be it any more; nor
    need segments be cut where they should be.
    """
    phases = Phases(progress, EXPECTED_PHASES * model.problem.estimation.starts)
    rules = bool(model.noisy_inputs)
    known = _by_input_noise(model, progress, phases) if rules else None
    if known is not None and known[0].tells_noise:
        return refined(*known, phases)
    if known is not None:
        model, fitted = known
    else:
        model = replace(model, noisy_inputs=())
        model, fitted = synchronised(model, fit(model, progress), phases)
        fitted = through_short_segments(model, fitted, phases)
        if not rules and is_moved_by_inputs(model) and not is_noise(fitted.program, fitted.solution):
            model, fitted = _by_input_noise(model, progress, phases) or (model, fitted)
    if rules or not may_leave_free_runs(model):
        return _ended(model, fitted, phases)
    if fitted.solution.converged:
        model, fitted = _ended(model, fitted, phases)
        if is_noise(fitted.program, fitted.solution):
            return model, fitted
        found = _instead_of_free_runs(model, fitted, progress, phases)
        return (model, fitted) if found is None else _ended(*found, phases)
    found = _instead_of_free_runs(model, fitted, progress, phases)
    return _ended(*(found or (model, fitted)), phases)


def _ended(model: Model, fitted: Fitted, phases: Phases) -> tuple[Model, Fitted]:
    """Return a fit with gaps that are laid, and integrator steps that are short enough, for what it found."""
    if model.train:
        model, fitted = relaid(model, fitted, phases)
    finer, fitted = refined(model, fitted, phases)
    if finer is model:
        return model, fitted
    if fits_free_run(model):
        return finer, detour(finer, fitted, phases)
    return relaid(finer, fitted, phases, CUTS)


def _by_input_noise(model: Model, progress: Progress, phases: Phases) -> tuple[Model, Fitted] | None:
    """Fit on segments that noise of measured inputs joins, and with that of noisy inputs as unknowns of every sample.

    Return the last that leaves no more than noise; None where both leave more. A problem whose inputs state their noise
    is fitted on such segments whatever these leave.
    """
    blunt = joined_by_input_noise(replace(model, tells_noise=False))
    seen, joined = synchronised(blunt, fit(blunt, progress), phases)
    if model.noisy_inputs:
        as_seen = with_late(with_moves(model, moves_of(seen)), late_of(seen))
        told = with_told_noise(as_seen, joined, phases)
        if told is not None:
            return told
    if model.joins_noise or is_noise(joined.program, joined.solution):
        return replace(seen, noisy_inputs=()), joined
    return None


def _instead_of_free_runs(
    model: Model, free: Fitted, progress: Progress, phases: Phases
) -> tuple[Model, Fitted] | None:
    """Fit on segments that noise of measured inputs joins, from the end of a fit of free runs.

    Such noise makes a free run wander: what is left of it is no sensor's noise, and its kinks may leave no way to an
    end. None where segments lead to no end either, or leave more than noise.
    """
    begun = replace(model, space=model.space.moved(free.solution.point.theta))
    found = _by_input_noise(begun, progress, phases)
    if found is None or not found[1].solution.converged:
        return None
    seen, joined = found
    return replace(seen, space=model.space, lost_free_run=True), joined


def relaid(model: Model, fitted: Fitted, phases: Phases, done: int = 0) -> tuple[Model, Fitted]:
    """Lay the gaps between segments for what was found, fit again, and so on until no gap moves; return both.

    What a torque noise gathers in a gap hangs on the inertia, and the size of a bristle on its stiffness: with gaps
    laid for the guesses the answer would hang on them. Torque noise that is asked for is estimated along the fit, too.
    Where free runs are fitted there are no gaps, and the noise is only reported. `done` turns were made before.
    """
    asked, joined = model.problem.estimation.estimated_noise, not fits_free_run(model)
    known = [fitted.program]
    for turn in range(done, MOST_TURNS):
        point = fitted.solution.point
        if joined:
            model = laid_for(model, dict(zip(model.space.names, map(float, point.theta), strict=True)))
        if asked:
            model = with_levels(model, most_likely(model, fitted.program, point))
        if not joined:
            break
        program = reweighed(model, fitted.program)
        if may_be_cut(model, program):
            afresh, there = divided_afresh(model, program, point)
            if turn < CUTS or all(moved_share(afresh, other) > SETTLED for other in known):
                program, point = afresh, there
                known.append(afresh)
        program = following(model, program)
        if are_alike(program, fitted.program, point.theta, SETTLED):
            return model, Fitted(replace(fitted.solution, objective=program.objective(point)), program)
        watch = phases.begin(f"gaps between segments, turn {turn + 1}")
        end = final_solver(model)(program, point, limits(model), watch)
        fitted = Fitted(replace(end, iterations=end.iterations + fitted.solution.iterations), program)
    return model, fitted


def _fit_once(model: Model, phases: Phases) -> Fitted:
    span = horizon(model)
    held = is_held(model.problem.drive)
    stated = bool(model.problem.estimation.process_noise)
    first = Plan(windowed(span), WIDTHS, True) if held and fits_free_run(model) else Plan(joined, WIDTHS[1:], stated)
    if keeps_the_loss(model, first.builder(model, 0.0, Squares())):
        return hop(model, fit_kept(model, first.builder, phases), phases)
    if held or not fits_free_run(model):
        return hop(model, staged(model, first, phases)[0], phases)
    return drifting(model, first, longest_recording(model) if span is None else span, phases)

"""How inputs are read between their samples: held, or joined by lines. A wrong reading looks like a delay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.additions import Forms, with_additions
from friction_ocp.diagnosis.excess import DOUBTED, Excess
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.footing import Footing, training_pieces
from friction_ocp.diagnosis.kinks import freed
from friction_ocp.diagnosis.polishing import polished, timed
from friction_ocp.diagnosis.worth import OF_REST, innovations
from friction_ocp.drive.parts import Channel, Drive
from friction_ocp.effects.effect import Key
from friction_ocp.estimation.horizon import judged_alike
from friction_ocp.estimation.model import Model, late_of, prepare, with_drive, with_late
from friction_ocp.estimation.problem import Problem
from friction_ocp.simulation.grid import FloatArray

_DRIVING = ("current", "current_command", "torque", "voltage")


def other_readings(problem: Problem) -> list[Problem]:
    """Return the problem with the inputs of its motors read the other way, and with its set points, as far as it has
    them."""
    inputs = problem.drive.inputs
    ways = [[item for item in inputs if item.signal in _DRIVING], [item for item in inputs if item.part == "reference"]]
    return [_read(problem, [_turned(item) for item in way]) for way in ways if way]


def _read(problem: Problem, turned: Sequence[Channel]) -> Problem:
    read = {item.name: item for item in turned}
    channels = tuple(read.get(item.name, item) for item in problem.drive.channels)
    return replace(problem, drive=replace(problem.drive, channels=channels))


def _turned(channel: Channel) -> Channel:
    return replace(channel, hold="linear" if channel.hold == "zero" else "zero")


def corrections(stated: Problem, read: Problem) -> list[str]:
    """Return a sentence for every input that is not read as stated."""
    before = {item.name: item.hold for item in stated.drive.inputs}
    words = {"zero": "is held between its samples", "linear": "runs in lines from sample to sample"}
    return [
        f"{item.name}: {words[item.hold]}: with `hold: {before[item.name]}` the recordings would need a delay"
        for item in read.drive.channels
        if item.hold != before.get(item.name, item.hold)
    ]


def read_otherwise(problem: Problem, fitted: FittedModel) -> FittedModel:
    """Return a base model fitted to inputs that are read as another problem says, from where it stands."""
    model = with_late(judged_alike(prepare(problem)), late_of(fitted.model))
    foot = replace(fitted.footing, train=training_pieces(model))
    return freed(timed(_begun_at(fitted, model, foot, fitted.theta)))


def _begun_at(known: FittedModel, model: Model, foot: Footing, theta: FloatArray) -> FittedModel:
    """Fit a model from some parameters and where the segments of a known one begin.

    Where that comes to less than what is known, from where the parameters say that segments begin, too.
    """
    program = foot.training(model)
    shapes = [(cut.count, len(program.drive.state_names)) for cut in program.segments]
    nodes = known.linear.point.nodes
    nodes = nodes if shapes == [one.shape for one in nodes] else None
    end = polished(model, foot, theta, nodes)
    if nodes is not None and not end.objective <= known.objective:
        end = min(end, polished(model, foot, theta, None), key=lambda one: one.objective)
    return end


def explains_more(
    base: FittedModel,
    stated: FittedModel,
    final: FittedModel,
    accepted: Sequence[Key],
    forms: Forms,
    left_over: bool,
) -> bool:
    """Whether another reading of the inputs, whose base model this is, does what an addition does or takes the rest.

    Or where more than noise is left, does more than one of the additions to the `stated` base model did in its turn:
    they may stand in for it. Additions have the `forms` in which they were accepted.
    """
    left = innovations(final)
    if not accepted:
        return left_over and innovations(base).ratio <= _notably_less(left)
    but_last = _ratio_with(base, accepted[:-1], final, forms)
    fewer = ([other for other in accepted if other != key] for key in accepted[:-1])
    enough = left.ratio * DOUBTED
    if but_last <= enough or any(_ratio_with(base, keys, final, forms) <= enough for keys in fewer):
        return True
    if not left_over:
        return False
    if but_last < left.ratio or _ratio_as(base, final) <= _notably_less(left):
        return True
    return any(
        _ratio_with(base, accepted[:k], final, forms) < _ratio_with(stated, accepted[: k + 1], final, forms)
        for k in range(len(accepted) - 1)
    )


def leaves_less(read: FittedModel, stated: FittedModel, fewer: bool) -> bool:
    """Whether a model whose inputs are `read` otherwise leaves notably less than the `stated` one does.

    As much, but for the doubt about floors, is enough with `fewer` additions.
    By the noise that the stated footing assumes, so that neither is measured by what its own inputs may hide.
    """
    foot = replace(stated.footing, train=training_pieces(read.model))
    again = _begun_at(read, read.model, foot, read.theta)
    left = innovations(stated)
    most = DOUBTED * left.ratio if fewer else _notably_less(left)
    return again.holds and innovations(again).ratio <= most


def _notably_less(left: Excess) -> float:
    """Return the power of innovations that is notably less than what is left: the rest of it beyond noise is gone.

    Where there is none, and a slow torque alone shows that something is missing, floors are in doubt as far.
    """
    return 1.0 + (1.0 - OF_REST) * left.beyond if left.beyond > 0.0 else left.ratio / DOUBTED


def is_needless(stated: FittedModel, final: FittedModel) -> bool:
    """Whether a final model whose inputs are read otherwise leaves no more where they are read as stated."""
    return _ratio_as(stated, final) <= DOUBTED * innovations(final).ratio


def _ratio_with(base: FittedModel, keys: Sequence[Key], final: FittedModel, forms: Forms) -> float:
    """Return the power of the innovations of a base model with some additions, fitted from where they were before.

    Infinite where its simulation breaks down there.
    """
    return _ratio_of(base, with_additions(base, keys, forms), final) if keys else innovations(base).ratio


def _ratio_as(base: FittedModel, final: FittedModel) -> float:
    """Return the power of the innovations of the final model, its inputs read as those of the base model."""
    drive, read = final.model.problem.drive, {item.name: item.hold for item in base.model.problem.drive.inputs}
    channels = tuple(replace(item, hold=read.get(item.name, item.hold)) for item in drive.channels)
    return _ratio_of(base, replace(drive, channels=channels), final)


def _ratio_of(base: FittedModel, drive: Drive, final: FittedModel) -> float:
    model = with_drive(base.model, drive)
    known = {**base.values, **final.values}
    fitted = _begun_at(base, model, base.footing, model.space.clip(model.space.with_known(known)))
    return innovations(fitted).ratio if fitted.holds else np.inf

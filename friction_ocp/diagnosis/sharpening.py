"""Models that leave no more than noise, fitted to what channels show beyond the torque noise within a segment.

Where the noise of a measured current moves a fine encoder within two samples by more than the encoder's own noise, all
samples between nodes are as blurred as that, and gaps are laid for one inertia. A model is then judged by how much it
answers to noise that its machine does not answer to: a rotor that is stated rightly looks too light. With gaps that
are each model's own, and samples at nodes alone, none is favoured. But what misses much would then make its gaps as
wide as it likes: that is judged as before.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.easing import along
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.footing import Footing, cuts, within
from friction_ocp.diagnosis.kinks import freed
from friction_ocp.diagnosis.options import level_of
from friction_ocp.diagnosis.polishing import polished, timed
from friction_ocp.diagnosis.worth import innovations
from friction_ocp.estimation.model import Model
from friction_ocp.simulation.grid import FloatArray

LEAST_KEPT = 0.3
"""Share of the samples of a channel that lie at nodes, below which its other samples count too, as blurred as they
are."""


def fitted_sharply(fitted: FittedModel, guesses: FloatArray) -> FittedModel:
    """Fit a model again on a sharpened footing; the same where there is none, or where more than noise is left there.

    From where it stands, which noise has drawn away from the truth, and from the guesses.
    """
    model, foot = fitted.model, sharpened(fitted.model, fitted.footing)
    if foot is fitted.footing or fitted.astray:
        return fitted
    here = along(foot.training(model), fitted.linear.program, fitted.linear.point)
    starts = [polished(model, foot, fitted.theta, here.nodes), polished(model, foot, guesses, None)]
    found = min((freed(timed(start)) for start in starts), key=lambda end: end.objective)
    return fitted if innovations(found).significant(level_of(model.problem)) else found


def sharpened(model: Model, foot: Footing) -> Footing:
    """Return a footing on which what torque noise blurs between nodes no longer counts, and gaps are each model's own.

    The same where it blurs no channel by more than that shows itself, where few samples lie at nodes, and where torque
    noise is stated: that moves the machine.
    """
    if foot.sharp or not foot.joined or foot.segment_s is None or model.problem.estimation.process_noise:
        return foot
    item = model.train[0]
    added, seen = within(model, foot, item, foot.segment_s), np.isfinite(item.measured)
    kept = np.sum(seen[cuts(item, foot.segment_s)], axis=0) / np.maximum(np.sum(seen, axis=0), 1)
    sharp = (added > model.noise**2) & (kept >= LEAST_KEPT)
    if not np.any(sharp):
        return foot
    noise = np.sqrt(model.noise**2 + np.where(sharp, 0.0, added))
    return replace(foot, noise=noise, sharp=tuple(map(bool, sharp)))

"""Whether what was added explains something, or is the shadow of what is not known."""

from __future__ import annotations

from collections.abc import Callable

from friction_ocp.diagnosis.excess import DOUBTED
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.free_gap import FreeErrors, comes_closer
from friction_ocp.diagnosis.worth import ALMOST, PART, innovations, samples

SHARED = 0.5
"""Share that free runs of recordings left out lose over that of the fitted ones, at least: causes came to 0.7 and more,
stand-ins for a limited rate of the current to 0.3 and 0.4 (blind suites of seeds 20261203 and 20261204)."""
NOTABLE_REST = 0.25
"""Share that is left of free runs' gap above which something further is looked for."""


def helps(
    base: FittedModel,
    current: FittedModel,
    level: float,
    left_out: Callable[[], tuple[FreeErrors, FreeErrors]],
    stray: Callable[[], bool],
) -> bool:
    """Whether what the current model has and the base model lacks takes a part of the gap, and of that of free runs.

    `left_out` returns free runs of both where training recordings took no part in the fits. What does next to nothing
    for them is no more than a shadow, be it most of the gap where it was fitted: of what goes there half the share has
    to go here, for certain; of what leaves no more than noise a part, unless free runs of the current model `stray` as
    far where noise alone sets them apart. Free runs that are lost say nothing, and against what takes almost all no
    more than that something else is missing, be it torque noise that nobody has stated: where all that was missing is
    less than the noise it has to be told from, they are asked all the same. Where models are compared by short
    predictions free runs go astray whatever is added, and are not asked.
    """
    predicted = current.footing.predicted
    if takes_almost_all(base, current):
        return True
    if not predicted and not innovations(current).significant(level):
        before, after = left_out()
        told = before.lost or after.drowned
        return told or after.excess() <= max(DOUBTED - 1.0, (1.0 - PART) * before.excess()) or stray()
    taken, whole = base.cost - current.cost, base.cost - 0.5 * samples(base)
    if taken < PART * whole:
        return False
    if predicted or 0.0 < ALMOST * whole <= taken:
        return True
    before, after = left_out()
    if before.lost or after.drowned:
        return True
    as_much = after.excess() <= (1.0 - SHARED * taken / whole) * before.excess()
    return as_much and comes_closer(before, after, current.model.problem.estimation.seed)


def takes_almost_all(base: FittedModel, current: FittedModel) -> bool:
    """Whether the current model takes almost all that the base model lacks, where that is louder than the noise."""
    noise = 0.5 * samples(base)
    whole = base.cost - noise
    return whole > noise and base.cost - current.cost >= ALMOST * whole


def fall_short(before: FreeErrors, after: FreeErrors) -> bool:
    """Whether a notable part of the gap that free runs of training recordings had is left, where they took no part.

    Small slow torques hide below the noise of samples and yet move the drive.
    """
    return not before.lost and not after.drowned and after.excess() > NOTABLE_REST * before.excess()

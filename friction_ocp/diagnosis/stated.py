"""Stated values that the recordings contradict: fitted parameters far from where their priors put them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.diagnosis.bench import blocks_like
from friction_ocp.diagnosis.blocks import blocks_of, stats
from friction_ocp.diagnosis.fitting import FittedModel, freed, polished
from friction_ocp.diagnosis.held_out import held_out
from friction_ocp.diagnosis.rival import Rival, Standing
from friction_ocp.diagnosis.screen import Screened
from friction_ocp.diagnosis.select import Choice
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.effects.effect import Augmentation
from friction_ocp.estimation.model import with_drive
from friction_ocp.parameters import Free
from friction_ocp.simulation.grid import FloatArray

CONTRADICTED = 3.0
"""Prior deviations between stated and fitted value beyond which the stated one is wrong."""
_SENSOR = {"gain": "sensor_gain", "offset": "sensor_offset", "delay": "sensor_delay"}


@dataclass(frozen=True)
class Contradiction:
    """A part whose stated values do not agree with the recordings."""

    effect: str
    component: str
    names: tuple[str, ...]
    """Parameters that lie too far away."""
    deviations: float
    """The largest distance, in prior deviations."""


def contradictions(fitted: FittedModel) -> list[Contradiction]:
    """Return what lies beyond the limit in a fitted model, the farthest first."""
    space = fitted.model.space
    distance: FloatArray = np.abs(fitted.theta - space.prior_mean) / space.prior_std
    drive = fitted.model.problem.drive
    found: dict[tuple[str, str], Contradiction] = {}
    for k in np.flatnonzero(np.isfinite(space.prior_std) & (distance > CONTRADICTED)):
        name, far = space.names[k], float(distance[k])
        key = _key(name.partition("@")[0], drive)
        known = found.get(key, Contradiction(*key, (), 0.0))
        found[key] = replace(known, names=(*known.names, name), deviations=max(known.deviations, far))
    return sorted(found.values(), key=lambda item: -item.deviations)


def _key(path: str, drive: Drive) -> tuple[str, str]:
    """Return effect and component of a parameter that is not as stated."""
    part, _, rest = path.partition(".")
    if any(item.name == part for item in drive.channels):
        return _SENSOR.get(rest, "parameter_error"), part
    return ("inertia_error" if rest == "inertia" else "parameter_error"), part


def released(current: FittedModel, item: Contradiction) -> tuple[FittedModel, Choice]:
    """Fit again without the priors that are contradicted; return the fit and the decision as a choice of one."""
    drive = _without_priors(current.model.problem.drive, item)
    model = with_drive(current.model, drive)
    fitted = freed(polished(model, current.footing, current.theta, current.linear.point.nodes))
    blocks = blocks_of(current.linear.rows)
    gains = blocks.sums(held_out(current)) - blocks_like(current, fitted, blocks)
    p_value = float(2.0 * stats.norm.sf(item.deviations))
    seen = Screened(item.effect, item.component, 0.5 * item.deviations**2, p_value, (), Augmentation(drive, {}, ()))
    rival = Rival(seen, Standing.of(fitted), gains, lambda: fitted)
    odds = float(np.exp(-0.5 * item.deviations**2))
    return fitted, Choice((rival,), (1.0 / (1.0 + odds),), odds / (1.0 + odds), True, (rival,), (rival,))


def _without_priors(drive: Drive, item: Contradiction) -> Drive:
    values = {leaf.path: leaf.value for leaf in drive_leaves(drive)}
    for name in item.names:
        value = values[name.partition("@")[0]]
        assert isinstance(value, Free)
        values[name.partition("@")[0]] = replace(value, prior_std=None, prior_mean=None)
    return bind_drive(drive, values)

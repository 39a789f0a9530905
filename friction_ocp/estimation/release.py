"""Starts of a full model around the answer of its nested one."""

from __future__ import annotations

import numpy as np

from friction_ocp.estimation.model import Model
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.simulation.grid import FloatArray

SHARES = (0.3, 1.0)
"""Stribeck parts over the Coulomb friction from which the released parameters start."""
COVERED = (0.02, 3.0)
"""Stribeck speeds over the typical speed that the released starts stand for."""
HIGHEST = 0.7
"""Highest start of a break or a Stribeck speed over the top speed."""
RELEASES = ((0.05, 0.4), (0.2, 0.8), (1.0, 1.5))
"""Pairs of Stribeck speed and highest break speed, over the typical speed, from which released parameters start."""


def released(model: Model, simple: ParameterSpace, theta: FloatArray) -> list[FloatArray]:
    """Return starts of the full model around the answer of the nested one.

    Speeds and sizes that the nested model does not have start from several places in the range of speeds with Stribeck
    parts of several sizes, the same whatever the guess: a free run has many ends, and which of them is found must not
    hang on it. The guess is one more start where it lies far from all of these.
    """
    known = dict(zip(simple.names, theta, strict=True))
    guess = model.space.with_known(known)
    shares = SHARES if any(".tau_s" in name for name in model.space.names) else SHARES[:1]
    starts: list[FloatArray] = []
    for place, highest_break in RELEASES:
        for share in shares:
            values = [
                _released_value(model, name, known, (place, highest_break), share, guess[k])
                for k, name in enumerate(model.space.names)
            ]
            starts.append(model.space.clip(np.array(values)))
    return starts if _is_covered(model, guess) else [model.space.clip(guess), *starts]


def _is_covered(model: Model, guess: FloatArray) -> bool:
    """Whether the Stribeck speeds of a start, of which there are some, lie where the released ones can come."""
    speeds = [k for k, name in enumerate(model.space.names) if ".omega_s" in name]
    places = [guess[k] / _typical_speed(model, model.space.names[k]) for k in speeds]
    return bool(places) and all(COVERED[0] <= place <= COVERED[1] for place in places)


def _released_value(
    model: Model, name: str, known: dict[str, float], places: tuple[float, float], share: float, default: float
) -> float:
    """Return a start that leaves the friction at the typical speed as the nested model has it.

    There exp(-place^-2) of the Stribeck part is left (exponent 2), and the Coulomb part gives up as much.
    """
    (place, highest_break), (stem, _, last) = places, name.partition("@")[0].rpartition(".")
    remaining = 1.0 / (1.0 + share * float(np.exp(-(place**-2.0))))
    if ".tau_s" in name:
        return (1.0 + share) * remaining * known.get(name.replace(".tau_s", ".tau_c"), default)
    if name.endswith(".load.stribeck"):
        return share * remaining * known.get(f"{stem}.coulomb", default)
    if name in known:
        return remaining * known[name] if _is_coulomb(name) else known[name]
    speed = _typical_speed(model, name)
    if ".omega_s" in name:
        return place * speed
    if stem.endswith(".breaks"):
        return highest_break * speed * (int(last) + 1) / _breaks(model.space, stem)
    if stem.endswith(".slopes"):
        return known.get(f"{stem}.0", default)
    return default


def within_reach(model: Model, start: FloatArray) -> FloatArray:
    """Return a start whose breaks and Stribeck speeds lie where the recordings go.

    Nothing depends on a break above all speeds of its shaft, and no fit could move it.
    """
    moved = start.copy()
    for k, name in enumerate(model.space.names):
        path = name.partition("@")[0]
        stem, _, last = path.rpartition(".")
        top = model.speeds[path.partition(".")[0]].top if path.partition(".")[0] in model.speeds else np.inf
        if ".omega_s" in path:
            moved[k] = min(start[k], HIGHEST * top)
        elif stem.endswith(".breaks"):
            moved[k] = min(start[k], HIGHEST * top * (int(last) + 1) / _breaks(model.space, stem))
    return model.space.clip(moved)


def _breaks(space: ParameterSpace, stem: str) -> int:
    """Return how many breaks a polyline has."""
    return len({name.partition("@")[0] for name in space.names if name.startswith(f"{stem}.")})


def _typical_speed(model: Model, name: str) -> float:
    shaft = name.partition(".")[0]
    known = [item.typical for item in model.speeds.values()]
    return model.speeds[shaft].typical if shaft in model.speeds else max(known, default=1.0)


def _is_coulomb(name: str) -> bool:
    return ".friction.tau_c" in name or name.endswith(".friction.load.coulomb")

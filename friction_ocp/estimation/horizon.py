"""Over what time a free run is judged: a drive that nothing holds drifts by nature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.drive.parts import Drive
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.modes import slowest_period

LONGEST_WINDOW = 10.0
PERIODS = 10.0


def horizon(model: Model) -> float | None:
    """Return the length, s, of the windows over which a free run is judged; None is the whole recording.

    The whole recording where a controller closes the loop or gravity, a spring or a prescribed motion holds the
    drive; else 10 s or ten slowest periods, whichever is shorter.
    """
    stated = model.problem.estimation.horizon_s
    if stated is not None:
        return stated
    if is_held(model.problem.drive):
        return None
    return min(LONGEST_WINDOW, PERIODS * slowest_period(model.drive, model.space, model.problem))


def longest_recording(model: Model) -> float:
    """Return the length of the longest training recording, s."""
    return max(float(item.grid.time[-1] - item.grid.time[0]) for item in model.train)


def judged_alike(model: Model) -> Model:
    """Return a model that states over what time its free runs are judged, and with it all that it is compared with.

    Gravity that is added would hold a drive that drifts, a further mode is faster than those that were there, and other
    guesses make other periods.
    """
    options = replace(model.problem.estimation, horizon_s=horizon(model))
    return replace(model, problem=replace(model.problem, estimation=options))


def fits_free_run(model: Model) -> bool:
    """Whether the fit minimises the error of the free run rather than that of relaxed segments."""
    if model.tells_noise:
        return False
    chosen = model.problem.estimation.fit
    return chosen == "simulation" if chosen else horizon(model) is None


def is_relaxed(model: Model) -> bool:
    """Whether the fit is one of relaxed segments, which are cut as differences grow: not one sample each."""
    return not model.tells_noise and not fits_free_run(model)


def is_held(drive: Drive) -> bool:
    """Whether every shaft is tied, through transmissions, to something that keeps it from drifting."""
    held = {shaft.name for shaft in drive.shafts if shaft.gravity is not None}
    held |= drive.prescribed
    if drive.controller is not None:
        held |= {motor.shaft for motor in drive.motors}
    for _ in drive.transmissions:
        for item in drive.transmissions:
            if held & {item.from_shaft, item.to_shaft}:
                held |= {item.from_shaft, item.to_shaft}
    return bool(np.all([shaft.name in held for shaft in drive.shafts]))

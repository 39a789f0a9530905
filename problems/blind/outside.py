"""Effects outside the catalogue: what a diagnosis can only call unknown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from plant import PlantAmplifier, PlantEndStop, PlantFrictionMemory, Trajectory

from blind import places
from blind.recording import Extra, Hidden
from blind.site import Effect, Rng, Site

Inputs = Mapping[str, Trajectory]


def _acting(site: Site, extra: Extra) -> Hidden:
    """Return the machine with one more thing acting on it."""
    before = site.hidden.extra

    def both(rng: Rng, duration: float) -> Inputs:
        return {**before(rng, duration), **extra(rng, duration)}

    return replace(site.hidden, extra=both)


def wind(site: Site, rng: Rng) -> Hidden:
    """Let a torque act that wanders at random, and back within a second or so (Ornstein-Uhlenbeck)."""
    size, memory = site.size * site.scales.torque(site.component), float(rng.uniform(0.3, 2.0))

    def blow(rng: Rng, duration: float) -> Inputs:
        time = np.arange(0.0, duration + 0.02, 0.01)
        keep, value = np.exp(-0.01 / memory), np.zeros(time.size)
        for k in range(1, time.size):
            value[k] = keep * value[k - 1] + np.sqrt(1 - keep**2) * rng.standard_normal()
        return {f"{site.component}.external_torque": Trajectory(time, size * value, "linear")}

    return _acting(site, blow)


def _pulses(rng: Rng, duration: float, length: tuple[float, float], count: float) -> tuple[np.ndarray, np.ndarray]:
    """Return begin and end of about `count` intervals at random times, which do not touch."""
    begins = np.sort(rng.uniform(0.05, 0.95, max(1, rng.poisson(count)))) * duration
    begins = begins[np.append(True, np.diff(begins) > 2.0 * length[1])]
    return begins, begins + rng.uniform(*length, begins.size)


def _switched(begins: np.ndarray, ends: np.ndarray, off: float, on: float) -> Trajectory:
    time = np.concatenate(([-1.0], np.column_stack([begins, ends]).ravel()))
    return Trajectory(time, np.concatenate(([off], np.tile([on, off], begins.size))))


def sticking(site: Site, rng: Rng) -> Hidden:
    """Let something catch the shaft now and then: dry friction added for a moment at random times."""
    level, length = site.size * 3.0 * site.scales.torque(site.component), site.machine.duration * 0.03

    def catch(rng: Rng, duration: float) -> Inputs:
        begins, ends = _pulses(rng, duration, (0.3 * length, length), 6.0)
        return {f"{site.component}.added_coulomb": _switched(begins, ends, 0.0, level)}

    return _acting(site, catch)


def dropouts(site: Site, rng: Rng) -> Hidden:
    """Let the amplifier switch off for moments at random times."""
    motor, longest = site.plant.motors[0].name, 0.04 * site.size * site.machine.duration

    def drop(rng: Rng, duration: float) -> Inputs:
        begins, ends = _pulses(rng, duration, (0.5 * longest, longest), 6.0)
        return {f"{motor}.enable": _switched(begins, ends, 1.0, 0.0)}

    return _acting(site, drop)


def magnetic_hysteresis(site: Site, rng: Rng) -> Hidden:
    """Let the torque depend on the history of the current."""
    width = float(site.scales.current() * rng.uniform(0.2, 0.6))
    return site.with_motor(amplifier=PlantAmplifier(hysteresis_share=0.9 * site.size, hysteresis_width=width))


def rate_limit(site: Site, rng: Rng) -> Hidden:
    """Limit the slope of the current."""
    slope = 0.3 * site.scales.current() / (site.size * site.machine.sample_time * 300.0)
    return site.with_motor(amplifier=PlantAmplifier(rate_limit=slope))


def friction_memory(site: Site, rng: Rng) -> Hidden:
    """Let dry friction depend on the acceleration."""
    omega, time = site.scales.truth[f"{site.component}.omega"], site.scales.truth["time"]
    scale = float(np.sqrt(np.mean(np.gradient(omega, time) ** 2))) * 0.5
    return site.with_shaft(memory=PlantFrictionMemory(0.9 * site.size * float(rng.choice((-1.0, 1.0))), scale))


def end_stop(site: Site, rng: Rng) -> Hidden:
    """Put a bumper inside the range of the shaft."""
    theta = site.scales.truth[f"{site.component}.theta"]
    at, travel = float(np.quantile(theta, rng.uniform(0.75, 0.9))), float(np.ptp(theta))
    stiffness = site.size * 20.0 * site.scales.torque(site.component) / travel
    return site.with_shaft(end_stop=PlantEndStop(-1e9, at, stiffness))


OUTSIDE = {
    effect.name: effect
    for effect in (
        Effect("wind", wind, places.last),
        Effect("sticking", sticking, places.rubbing),
        Effect("dropouts", dropouts, places.first),
        Effect("magnetic_hysteresis", magnetic_hysteresis, places.amplified),
        Effect("rate_limit", rate_limit, places.amplified),
        Effect("friction_memory", friction_memory, places.rubbing),
        Effect("end_stop", end_stop, places.last),
    )
}

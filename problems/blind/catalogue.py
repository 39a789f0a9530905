"""The effects of the catalogue, hidden in a plant: what each is at a size between 0 and 1, and where it can sit.

The forms are those of the plant, drawn at random within what is physical; none is taken from the package.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from plant import (
    PlantAmplifier,
    PlantFriction,
    PlantLoop,
    PlantRipple,
    PlantSaturation,
    PlantShaft,
    PlantTransmission,
    PlantWarmUp,
)

from blind import places
from blind.recording import Hidden
from blind.site import Effect, Rng, Site, harmonics, sign


def stribeck(site: Site, rng: Rng) -> Hidden:
    """Let dry friction rise towards standstill."""
    base = site.shaft.friction
    speed = site.scales.speed(site.component) * np.exp(rng.uniform(np.log(0.04), np.log(0.4)))
    rise = site.size * 2.0 * site.scales.friction(site.component)
    delta = float(rng.uniform(0.8, 2.0))
    return site.with_friction(law="stribeck", tau_s=base.tau_c + rise, omega_s=float(speed), delta=delta)


def polyline_break(site: Site, rng: Rng) -> Hidden:
    """Let the viscous slope change at a speed, up or down."""
    base, speed = site.shaft.friction, site.scales.speed(site.component)
    steep = base.viscous + site.size * 3.0 * site.scales.friction(site.component) / speed
    slopes = (steep, base.viscous) if rng.uniform() < 0.5 else (base.viscous, steep)
    breaks = (float(speed * rng.uniform(0.3, 1.0)),)
    return site.with_shaft(friction=PlantFriction("polyline", tau_c=base.tau_c, slopes=slopes, breaks=breaks))


def quadratic_drag(site: Site, rng: Rng) -> Hidden:
    """Add drag that grows with the square of the speed."""
    speed = site.scales.speed(site.component)
    drag = site.size * 2.0 * site.scales.friction(site.component) / speed**2
    return site.with_friction(law="quadratic", quadratic=drag)


def asymmetry(site: Site, rng: Rng) -> Hidden:
    """Let Coulomb or viscous friction differ by direction."""
    name = str(rng.choice(["tau_c", "tau_c", "viscous"]))
    value, share = getattr(site.shaft.friction, name), 0.9 * site.size * sign(rng)
    return site.with_friction(**{name: (value * (1 + share), value * (1 - share))})


def position_ripple(site: Site, rng: Rng) -> Hidden:
    """Let dry friction vary with the angle."""
    period = site.scales.travel(site.component) / np.exp(rng.uniform(np.log(3.0), np.log(20.0)))
    return site.with_shaft(ripple=harmonics(0.8 * site.size, float(period), rng))


def presliding(site: Site, rng: Rng) -> Hidden:
    """Make friction elastic before breakaway: LuGre, or three Maxwell-slip elements."""
    base = site.shaft.friction
    reach = site.size * 0.02 * site.scales.travel(site.component)
    if rng.uniform() < 0.5:
        stiffness = base.tau_c / reach
        rate = 0.3 * float(np.sqrt(stiffness * site.scales.inertia(site.component)))
        return site.with_friction(law="lugre", sigma0=stiffness, sigma1=rate)
    shares = rng.dirichlet((4.0, 4.0, 4.0))
    reaches = reach * np.array([0.3, 1.0, 3.0])
    elements = tuple(
        (float(base.tau_c * share / way), float(share)) for share, way in zip(shares, reaches, strict=True)
    )
    return site.with_friction(law="gms", elements=elements)


def load_dependence(site: Site, rng: Rng) -> Hidden:
    """Let friction grow with the torque that the shaft passes on."""
    share = site.size * 0.5
    if rng.uniform() < 0.7:
        return site.with_friction(load_coulomb=share)
    return site.with_friction(load_viscous=share / site.scales.speed(site.component))


def warm_up(site: Site, rng: Rng) -> Hidden:
    """Let friction fall as the drive warms up within a recording, by time or by the power it loses."""
    time_constant = float(site.machine.duration * rng.uniform(0.3, 1.5))
    dry, viscous = -0.8 * site.size * rng.uniform(0.3, 1.0), -0.8 * site.size
    power = 0.0
    if rng.uniform() < 0.5:
        power = 0.5 * site.scales.friction(site.component) * site.scales.speed(site.component)
    return site.with_shaft(warm_up=PlantWarmUp(time_constant, float(dry), float(viscous), power))


def _turn_share(site: Site, rng: Rng) -> float:
    """Return a period of 2 pi / n whose frequency at typical speed lies below a tenth of the sampling rate."""
    most = 0.1 / site.machine.sample_time * 2 * np.pi / site.scales.speed(site.component)
    return 2 * np.pi / int(rng.choice([n for n in (1, 2, 4, 6, 7, 11, 12, 14, 21, 24) if n <= max(1.0, most)]))


def cogging(site: Site, rng: Rng) -> Hidden:
    """Let the motor cog."""
    size = site.size * site.scales.torque(site.component)
    return site.with_motor(cogging=harmonics(size, _turn_share(site, rng), rng))


def torque_ripple(site: Site, rng: Rng) -> Hidden:
    """Let the torque constant ripple over the angle."""
    return site.with_motor(torque_ripple=harmonics(0.6 * site.size, _turn_share(site, rng), rng))


def drive_lag(site: Site, rng: Rng) -> Hidden:
    """Let the torque follow the command late: a first-order lag, part of it pure delay."""
    late, dead = 0.05 * site.size, float(rng.choice([0.0, 0.0, 0.3]))
    return site.with_motor(amplifier=PlantAmplifier(delay=late * dead, time_constant=late * (1 - dead)))


def torque_saturation(site: Site, rng: Rng) -> Hidden:
    """Let the torque per ampere fall with the current."""
    limit = 0.8 * site.scales.current() / site.size
    form = str(rng.choice(["tanh", "algebraic", "cubic"]))
    return site.with_motor(saturation=PlantSaturation(limit, form, float(rng.uniform(1.5, 4.0))))


def backlash(site: Site, rng: Rng) -> Hidden:
    """Give an elastic transmission free play."""
    return site.with_joint(backlash=site.size * 10.0 * site.scales.twist(site.component))


def compliance(site: Site, rng: Rng) -> Hidden:
    """Make a rigid transmission elastic; the mode falls from 400 Hz to 4 Hz with the size."""
    ends = {s.name: s.inertia for s in site.plant.shafts}
    start, end = site.component.split("-")
    reduced = 1.0 / (1.0 / (ends[start] * site.joint.ratio**2) + 1.0 / ends[end])
    rate = 2 * np.pi * 4.0 / np.sqrt(site.size)
    stiffness = float(reduced * rate**2)
    return site.with_joint(stiffness=stiffness, damping=float(2 * rng.uniform(0.03, 0.1) * reduced * rate))


def stiffening(site: Site, rng: Rng) -> Hidden:
    """Let stiffness grow with the twist: with its cube, or by a second stage."""
    stiffness, twist = site.joint.stiffness, site.scales.twist(site.component)
    if rng.uniform() < 0.6:
        return site.with_joint(cubic=site.size * 4.0 * stiffness / twist**2)
    return site.with_joint(second_stage=(site.size * 4.0 * stiffness, float(twist * rng.uniform(0.3, 0.8))))


def transmission_hysteresis(site: Site, rng: Rng) -> Hidden:
    """Put a loop beside the spring: three Jenkins elements, or one smooth element."""
    torque = site.size * 1.0 * site.scales.joint_torque(site.component)
    twist = float(site.scales.twist(site.component) * np.exp(rng.uniform(np.log(0.2), np.log(0.8))))
    if rng.uniform() < 0.5:
        return site.with_joint(loop=PlantLoop(((torque, twist),), smooth=True))
    elements = tuple((torque / 3.0, twist * factor) for factor in (0.4, 1.0, 2.0))
    return site.with_joint(loop=PlantLoop(elements))


def kinematic_error(site: Site, rng: Rng) -> Hidden:
    """Let the ratio ripple: one, two or four times a turn of the input."""
    size = 3.0 * site.size * site.scales.twist(site.component)
    period = 2 * np.pi / int(rng.choice([1, 2, 4]))
    return site.with_joint(kinematic_error=harmonics(size, period, rng))


def unbalance(site: Site, rng: Rng) -> Hidden:
    """Hang a weight on the shaft."""
    torque = site.size * site.scales.torque(site.component)
    return site.with_shaft(gravity=(torque, float(rng.uniform(-np.pi, np.pi))))


def constant_torque(site: Site, rng: Rng) -> Hidden:
    """Let a constant torque act on the shaft."""
    return site.with_shaft(external_torque=sign(rng) * site.size * site.scales.torque(site.component))


def periodic_disturbance(site: Site, rng: Rng) -> Hidden:
    """Let a torque periodic in time act on the shaft."""
    size = site.size * site.scales.torque(site.component)
    period = np.exp(rng.uniform(np.log(0.02), np.log(0.25))) * site.machine.duration
    return site.with_shaft(disturbance=harmonics(size, float(period), rng))


def structural_mode(site: Site, rng: Rng) -> Hidden:
    """Hang a part of the inertia on a spring of its own."""
    moved = 0.8 * site.size * site.shaft.inertia
    rate = 2 * np.pi * float(np.exp(rng.uniform(np.log(5.0), np.log(30.0)))) * 1e-3 / site.machine.sample_time
    flexible = PlantShaft(f"{site.component}_mode", moved)
    spring = PlantTransmission(
        site.component, flexible.name, 1.0, moved * rate**2, 2 * float(rng.uniform(0.01, 0.05)) * moved * rate
    )
    plant = site.with_shaft(inertia=site.shaft.inertia - moved).plant
    grown = replace(plant, shafts=(*plant.shafts, flexible), transmissions=(*plant.transmissions, spring))
    return replace(site.hidden, plant=grown)


def inertia_error(site: Site, rng: Rng) -> Hidden:
    """Let the true inertia differ from the one that the file states."""
    return site.with_shaft(inertia=site.shaft.inertia * float(np.exp(1.2 * site.size * sign(rng))))


def parameter_error(site: Site, rng: Rng) -> Hidden:
    """Let another stated number of the part be wrong."""
    factor = float(np.exp(0.8 * site.size * sign(rng)))
    if site.component == site.plant.motors[0].name:
        return site.with_motor(torque_constant=site.plant.motors[0].torque_constant * factor)
    if "-" in site.component:
        return site.with_joint(stiffness=site.joint.stiffness * factor)
    torque, phase = site.shaft.gravity
    return site.with_shaft(gravity=(torque * factor, phase))


def sensor_offset(site: Site, rng: Rng) -> Hidden:
    """Shift the zero of a sensor."""
    return site.with_sensor(offset=sign(rng) * site.size * _signal_scale(site))


def sensor_gain(site: Site, rng: Rng) -> Hidden:
    """Scale a sensor wrongly."""
    return site.with_sensor(gain=1.0 + 0.3 * site.size * sign(rng))


def sensor_delay(site: Site, rng: Rng) -> Hidden:
    """Let a sensor report late."""
    return site.with_sensor(delay=30.0 * site.size * site.machine.sample_time)


def sensor_eccentricity(site: Site, rng: Rng) -> Hidden:
    """Mount the disc of an encoder off its centre."""
    phase = rng.uniform(0.0, 2 * np.pi)
    size = 0.3 * site.size
    wobble = PlantRipple(2 * np.pi, float(size * np.cos(phase)), float(size * np.sin(phase)))
    return site.with_sensor(eccentricity=wobble)


def _signal_scale(site: Site) -> float:
    """Return the typical size of what a channel measures."""
    shaft, _, signal = site.machine.document["channels"][site.component]["measures"].partition(".")
    if signal == "theta":
        return 0.3 * site.scales.travel(shaft)
    if signal == "current":
        return site.scales.current()
    return float(np.sqrt(np.mean(site.scales.truth[f"{shaft}.{signal}"] ** 2)))


CATALOGUE = {
    effect.name: effect
    for effect in (
        Effect("stribeck", stribeck, places.rubbing),
        Effect("polyline_break", polyline_break, places.rubbing),
        Effect("quadratic_drag", quadratic_drag, places.rubbing),
        Effect("asymmetry", asymmetry, places.rubbing),
        Effect("position_ripple", position_ripple, places.rubbing),
        Effect("presliding", presliding, places.rubbing),
        Effect("load_dependence", load_dependence, places.passing),
        Effect("warm_up", warm_up, places.rubbing),
        Effect("cogging", cogging, places.first),
        Effect("torque_ripple", torque_ripple, places.first),
        Effect("drive_lag", drive_lag, places.first),
        Effect("torque_saturation", torque_saturation, places.first),
        Effect("backlash", backlash, lambda machine: places.joints(machine, rigid=False)),
        Effect("compliance", compliance, lambda machine: places.joints(machine, rigid=True)),
        Effect("stiffening", stiffening, lambda machine: places.joints(machine, rigid=False)),
        Effect("transmission_hysteresis", transmission_hysteresis, lambda machine: places.joints(machine, rigid=False)),
        Effect("kinematic_error", kinematic_error, lambda machine: places.joints(machine, rigid=False)),
        Effect("unbalance", unbalance, places.balanced),
        Effect("constant_torque", constant_torque, places.shafts),
        Effect("periodic_disturbance", periodic_disturbance, places.shafts),
        Effect("structural_mode", structural_mode, places.shafts),
        Effect("inertia_error", inertia_error, places.shafts),
        Effect("parameter_error", parameter_error, places.stated),
        Effect("sensor_offset", sensor_offset, places.sensors),
        Effect("sensor_gain", sensor_gain, places.sensors),
        Effect("sensor_delay", sensor_delay, places.sensors),
        Effect("sensor_eccentricity", sensor_eccentricity, places.wheels),
    )
}

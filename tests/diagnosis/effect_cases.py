"""One case for every effect of the catalogue: a drive of the plant that has it, and a model that lacks it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from diagnosis_cases import COULOMB, INERTIA, TORQUE_CONSTANT, VISCOUS, axis, write_case
from plant import (
    Plant,
    PlantAmplifier,
    PlantFriction,
    PlantLoop,
    PlantRipple,
    PlantSaturation,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    PlantWarmUp,
)

Document = dict[str, Any]
Change = Callable[[Document], None]

RATIO, STIFFNESS, DAMPING = 5.0, 800.0, 0.3
"""Of the gear behind which there is a load as heavy as the motor, N m/rad and N m s/rad."""
FINE_STEP = 2.0 * np.pi / 2**18
TORQUE = 0.5 * TORQUE_CONSTANT
"""Of half an ampere, N m: what moves the axis at least."""


def as_it_is(document: Document) -> None:
    """Leave the model with Coulomb and viscous friction alone."""


@dataclass(frozen=True)
class EffectCase:
    """What hides an effect, and which others compete."""

    plant: Plant
    place: str
    rivals: Sequence[str]
    model: Change = field(default=as_it_is)
    """Makes the problem of the model out of that of one mass."""

    def write(self, name: str, folder: Path) -> Path:
        """Write recordings and problem for the effect of a name."""
        path = write_case(folder, self.plant, effects=[name, *self.rivals])
        document: Document = yaml.safe_load(path.read_text(encoding="utf-8"))
        document["title"] = f"What lacks {name}"
        self.model(document)
        path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
        return path


def shaft(**changes: Any) -> Plant:
    """Return the axis with changes to its shaft."""
    return replace(axis(), shafts=(replace(axis().shafts[0], **changes),))


def motor(**changes: Any) -> Plant:
    """Return the axis with changes to its motor."""
    return replace(axis(), motors=(replace(axis().motors[0], **changes),))


def late(seconds: float) -> Plant:
    """Return the axis whose motor follows late what is recorded: the command."""
    lagging = motor(amplifier=PlantAmplifier(time_constant=seconds))
    command = replace(lagging.sensors[1], measures="motor.command", noise_std=0.0)
    return replace(lagging, sensors=(lagging.sensors[0], command))


def sensor(**changes: Any) -> Plant:
    """Return the axis with changes to its encoder."""
    return replace(axis(), sensors=(replace(axis().sensors[0], **changes), *axis().sensors[1:]))


def geared(**joint: Any) -> Plant:
    """Return motor and load, each with an encoder, on an elastic gear with changes."""
    plain = axis()
    behind = PlantShaft("load", RATIO**2 * INERTIA, PlantFriction("coulomb_viscous", tau_c=0.2, viscous=0.02))
    gear = PlantTransmission(**{"from_shaft": "motor", "to_shaft": "load", "ratio": RATIO, **ELASTIC, **joint})
    encoder = PlantSensor("load_position", "load.theta", period=plain.sensors[0].period, resolution=FINE_STEP)
    sensors = (*plain.sensors, encoder)
    return replace(plain, shafts=(*plain.shafts, behind), transmissions=(gear,), sensors=sensors)


ELASTIC = {"stiffness": STIFFNESS, "damping": DAMPING}


def with_gear(stiffness: Any = None) -> Change:
    """Return what adds gear and load to the model, the gear as stiff as stated, else to be found."""

    def add(document: Document) -> None:
        friction = {"tau_c": {"guess": 0.22, "min": 0}, "viscous": {"guess": 0.018, "min": 0}}
        load = {"inertia": {"guess": 0.055, "min": 1e-3}, "friction": {"law": "coulomb_viscous", **friction}}
        document["drive"]["shafts"].append({"name": "load", **load})
        gear: Document = {"ratio": RATIO, "stiffness": stiffness or {"guess": 0.9 * STIFFNESS, "min": 10}}
        if stiffness != "rigid":
            gear["damping"] = {"guess": DAMPING, "min": 0}
        document["drive"]["transmissions"] = [gear]
        document["channels"]["load_position"] = {"measures": "load.theta", "resolution": FINE_STEP}

    return add


def both(first: Change, second: Change) -> Change:
    """Return what changes a model twice."""

    def change(document: Document) -> None:
        first(document)
        second(document)

    return change


def without_friction(document: Document) -> None:
    """Take all friction out of the model."""
    del document["drive"]["shafts"][0]["friction"]


def stating(inertia: float) -> Change:
    """Return what states the inertia as known."""

    def state(document: Document) -> None:
        document["drive"]["shafts"][0]["inertia"] = inertia

    return state


def hung(share: float, rate: float) -> Plant:
    """Return the axis with a share of its inertia on a spring, of a frequency in rad/s while the motor stands still."""
    mass = share * INERTIA
    spring = PlantTransmission("motor", "part", 1.0, mass * rate**2, 0.06 * mass * rate)
    rest = replace(axis().shafts[0], inertia=INERTIA - mass)
    return replace(axis(), shafts=(rest, PlantShaft("part", mass, PlantFriction("none"))), transmissions=(spring,))


BREAK = PlantFriction("polyline", tau_c=COULOMB, slopes=(3.0 * VISCOUS, VISCOUS), breaks=(40.0,))
LOADED = PlantFriction("coulomb_viscous", COULOMB, viscous=VISCOUS, load_coulomb=0.15)
LOOP = PlantLoop(((0.6, 4e-4),))
"""A quarter of the torque that the gear passes on."""

CASES: dict[str, EffectCase] = {
    "friction": EffectCase(axis(), "motor", ("sensor_gain", "periodic_disturbance"), without_friction),
    "stribeck": EffectCase(axis(law="stribeck", tau_s=0.16, omega_s=8.0), "motor", ("presliding", "warm_up")),
    "polyline_break": EffectCase(shaft(friction=BREAK), "motor", ("quadratic_drag", "stribeck")),
    "quadratic_drag": EffectCase(axis(law="quadratic", quadratic=1e-5), "motor", ("polyline_break", "asymmetry")),
    "asymmetry": EffectCase(axis(viscous=(1.3 * VISCOUS, 0.7 * VISCOUS)), "motor", ("constant_torque", "unbalance")),
    "presliding": EffectCase(axis(law="dahl", sigma0=4.0), "motor", ("stribeck", "asymmetry")),
    "load_dependence": EffectCase(shaft(friction=LOADED), "motor", ("quadratic_drag", "torque_saturation")),
    "position_ripple": EffectCase(
        shaft(ripple=PlantRipple(7.0, (0.4,), (0.0,))), "motor", ("cogging", "torque_ripple")
    ),
    "warm_up": EffectCase(shaft(warm_up=PlantWarmUp(2.0, -0.3, -0.5, 0.0)), "motor", ("quadratic_drag", "drive_lag")),
    "cogging": EffectCase(
        motor(cogging=PlantRipple(3.1, (0.1 * TORQUE,), (0.0,))), "motor", ("torque_ripple", "unbalance")
    ),
    "torque_ripple": EffectCase(
        motor(torque_ripple=PlantRipple(3.1, (0.2,), (0.0,))), "motor", ("cogging", "unbalance")
    ),
    "drive_lag": EffectCase(late(0.006), "motor", ("torque_saturation", "sensor_delay")),
    "torque_saturation": EffectCase(motor(saturation=PlantSaturation(3.0)), "motor", ("quadratic_drag", "drive_lag")),
    "backlash": EffectCase(geared(backlash=0.01), "motor-load", ("stiffening", "kinematic_error"), with_gear()),
    "compliance": EffectCase(
        geared(), "motor-load", ("backlash", "kinematic_error", "sensor_delay"), with_gear("rigid")
    ),
    "stiffening": EffectCase(geared(cubic=2e7), "motor-load", ("transmission_hysteresis", "backlash"), with_gear()),
    "transmission_hysteresis": EffectCase(geared(loop=LOOP), "motor-load", ("stiffening", "backlash"), with_gear()),
    "kinematic_error": EffectCase(
        geared(kinematic_error=PlantRipple(2.0 * np.pi, (5e-4,), (0.0,))),
        "motor-load",
        ("backlash", "cogging"),
        with_gear(),
    ),
    "unbalance": EffectCase(shaft(gravity=(0.1 * TORQUE, 0.7)), "motor", ("position_ripple", "constant_torque")),
    "constant_torque": EffectCase(shaft(external_torque=0.1 * TORQUE), "motor", ("asymmetry", "unbalance")),
    "periodic_disturbance": EffectCase(
        shaft(disturbance=PlantRipple(0.9, (0.1 * TORQUE,), (0.0,))), "motor", ("cogging",)
    ),
    "structural_mode": EffectCase(hung(0.3, 2.0 * np.pi * 9.0), "motor", ("drive_lag", "sensor_delay")),
    "inertia_error": EffectCase(axis(), "motor", ("drive_lag", "quadratic_drag"), stating(1.25 * INERTIA)),
    "parameter_error": EffectCase(
        geared(), "motor-load", ("stiffening", "backlash"), both(stating(INERTIA), with_gear(1.4 * STIFFNESS))
    ),
    "sensor_offset": EffectCase(
        replace(axis(), sensors=(axis().sensors[0], replace(axis().sensors[1], offset=0.05))),
        "current",
        ("sensor_gain", "unbalance"),
    ),
    "sensor_gain": EffectCase(sensor(gain=1.03), "position", ("torque_saturation", "drive_lag"), stating(INERTIA)),
    "sensor_delay": EffectCase(sensor(delay=0.005), "position", ("drive_lag", "quadratic_drag")),
    "sensor_eccentricity": EffectCase(
        sensor(eccentricity=PlantRipple(2.0 * np.pi, (0.01,), (0.0,))), "position", ("cogging", "sensor_gain")
    ),
}

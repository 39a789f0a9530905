"""A drive without the terms that are plainly zero: they cost no symbol, no state and no instruction."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol, TypeVar

from friction_ocp.drive.parts import SHARPNESS, Channel, Drive, Motor, Shaft, Transmission
from friction_ocp.friction.composite import Bristled
from friction_ocp.parameters import Value, is_off


class _Term(Protocol):
    @property
    def idle(self) -> bool: ...


Term = TypeVar("Term", bound=_Term)


def live_terms(drive: Drive) -> Drive:
    """Return the drive with None in place of every optional term whose amplitude is a plain zero."""
    return replace(
        drive,
        shafts=tuple(_shaft(item) for item in drive.shafts),
        transmissions=tuple(_transmission(item) for item in drive.transmissions),
        motors=tuple(_motor(item) for item in drive.motors),
        channels=tuple(_channel(item) for item in drive.channels),
    )


def _live(term: Term | None) -> Term | None:
    return None if term is None or term.idle else term


def _on(value: Value) -> Value:
    return None if is_off(value) else value


def _shaft(shaft: Shaft) -> Shaft:
    friction, warm_up = shaft.friction, _live(shaft.friction.warm_up)
    warm_up = None if warm_up is None else warm_up.live()
    law = friction.law
    if isinstance(law, Bristled):
        law = replace(law, bristle=replace(law.bristle, springs=_live(law.bristle.springs)))
    friction = replace(friction, law=law, ripple=_live(friction.ripple), warm_up=warm_up)
    return replace(shaft, friction=friction, disturbance=_live(shaft.disturbance))


def _transmission(item: Transmission) -> Transmission:
    loop = _live(item.hysteresis)
    return replace(
        item,
        backlash=_on(item.backlash),
        stiffening=_on(item.stiffening),
        second_stage=_live(item.second_stage),
        hysteresis=None if loop is None else replace(loop, springs=_live(loop.springs)),
        kinematic_error=_live(item.kinematic_error),
    )


def _motor(motor: Motor) -> Motor:
    off = is_off(motor.saturation)
    plain = off or (motor.saturation_tail is None and motor.saturation_sharpness == SHARPNESS)
    return replace(
        motor,
        cogging=_live(motor.cogging),
        torque_ripple=_live(motor.torque_ripple),
        lag=_on(motor.lag),
        lag_hidden=None if is_off(motor.lag) else _on(motor.lag_hidden),
        dead_time=_on(motor.dead_time),
        saturation=_on(motor.saturation),
        saturation_sharpness=None if plain else motor.saturation_sharpness,
        saturation_tail=None if off else motor.saturation_tail,
        saturation_in_emf=None if off or motor.saturation_in_emf == 1.0 else motor.saturation_in_emf,
    )


def _channel(channel: Channel) -> Channel:
    return replace(channel, eccentricity=_live(channel.eccentricity))

"""Effects on the curve of friction over speed."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import Any, ClassVar

from friction_ocp.drive.parts import Drive, Shaft
from friction_ocp.drive.values import drive_leaves
from friction_ocp.effects.effect import (
    AbstractEffect,
    Augmentation,
    Clues,
    Hiding,
    Trial,
    change_shaft,
    either_way,
    fitted_friction,
    moving_shafts,
    upwards,
)
from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.composite import (
    SHARES,
    Bend,
    Bristled,
    StribeckRise,
    added_terms,
    plain_law,
    viscous_part,
    with_added,
)
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.maxwell import AbstractMaxwellSlip
from friction_ocp.friction.static import CoulombViscous, NoFriction, Polyline, Quadratic, Stribeck, Viscous
from friction_ocp.parameters import Directional, Free, Tie, Value, is_off

SHARE = 0.05
"""Size of a trial over the torque that moves the shaft: small, yet far above rounding."""


PARTS = {"tau_c": 1, "viscous": 2}
"""Parameters of friction that two shafts may share, and the power of the speed ratio by which they are larger behind a
reducer."""


EXPONENT = 2.0
"""Of the Stribeck curve, as long as nothing else is known. Source: Bo & Pavelescu 1982 find 0.5 to 1, Tustin 1947
takes 1, Armstrong-Helouvry 1991 takes 2."""


TAIL = 0.3
"""Tail of a Stribeck curve that is tried, a third of Hess & Soom's."""


UNEVEN, MOST_UNEVEN = 0.1, 0.9
"""Share by which friction near standstill differs from its mean over both directions: tried, and at most."""


def with_friction(drive: Drive, shaft: Shaft, **terms: Any) -> Drive:
    """Return the drive with terms added to the friction of a shaft."""
    element = shaft.friction
    return change_shaft(drive, shaft.name, friction=replace(element, law=with_added(element.law, **terms)))


def lacks(law: AbstractFrictionLaw, term: str) -> bool:
    """Whether terms can be added to a law, and it has none of this name."""
    if isinstance(law, AbstractMaxwellSlip):
        return False
    terms = added_terms(law)
    return terms is None or getattr(terms, term) is None


def is_dry(shaft: Shaft) -> bool:
    """Whether a shaft has dry friction."""
    return not isinstance(plain_law(shaft.friction.law), (NoFriction, Viscous))


def halved(drive: Drive, dry: Collection[str], name: str, clues: Clues) -> dict[str, float]:
    """Return friction by path where a shaft without any takes half of what is fitted at `dry` ones, at the same power.

    Where a spring parts them, or is to, it matters on which side something rubs, and a model may have all on one.
    """
    found = {f"{name}.friction.{part}": 0.0 for part in PARTS}
    for leaf in drive_leaves(drive):
        shaft, _, part = leaf.path.partition(".friction.")
        if shaft in dry and part in PARTS and isinstance(leaf.value, Free):
            found[leaf.path] = 0.5 * clues.numbers[leaf.path]
            faster = clues.typical_speed(shaft) / clues.typical_speed(name)
            found[f"{name}.friction.{part}"] += found[leaf.path] * faster ** PARTS[part]
    return found


def stribeck_speed(clues: Clues, place: str) -> tuple[Free, list[float]]:
    """Return the free Stribeck speed of friction that falls with the speed, and where it is tried, in rising order."""
    speed = clues.typical_speed(place)
    tried = sorted({*clues.speed_quantiles(place, (0.1, 0.3, 0.5, 0.8)), 0.01 * speed, 0.03 * speed, 0.1 * speed})
    return Free(tried[len(tried) // 2], 1e-2 * tried[0], 3.0 * speed), tried


def _turning_alike(drive: Drive, name: str) -> set[str]:
    """Return a shaft and those that rigid joints join to it; of any drive, be it that no model can be made of it."""
    alike = {name}
    for _ in drive.transmissions:
        for item in drive.transmissions:
            ends = {item.from_shaft, item.to_shaft}
            alike |= ends if item.rigid and ends & alike else set()
    return alike


class FrictionEffect(AbstractEffect):
    """The model knows of no friction of a shaft, nor of those rigidly joined to it."""

    name: ClassVar[str] = "friction"
    sentence: ClassVar[str] = "there is dry and viscous friction where the model has none"

    def places(self, drive: Drive) -> Iterable[str]:
        """Return the shafts that turn without any friction: what another rubs that turns alike is in that one's."""
        rubbed = {shaft.name for shaft in drive.shafts if not isinstance(shaft.friction.law, NoFriction)}
        for shaft in moving_shafts(drive):
            if not rubbed & _turning_alike(drive, shaft.name):
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        dry, viscous = f"{place}.friction.tau_c", f"{place}.friction.viscous"
        size = SHARE * clues.typical_torque[place]
        slope = size / max(clues.speed_quantiles(place, (0.9,))[0], 1e-12)
        law = CoulombViscous(upwards(size), upwards(slope))
        added = change_shaft(drive, place, friction=replace(drive.shaft(place).friction, law=law))
        begin = halved(drive, [shaft.name for shaft in drive.shafts if is_dry(shaft)], place, clues)
        large = (begin,) if any(begin.values()) else ()
        return Augmentation(added, {dry: 0.0, viscous: 0.0}, (Trial(({dry: size}, {viscous: slope})),), outright=large)


class StribeckEffect(AbstractEffect):
    """Friction falls with speed near standstill."""

    name: ClassVar[str] = "stribeck"
    sentence: ClassVar[str] = "friction falls with speed near standstill"
    resembles: ClassVar[tuple[str, ...]] = ("polyline_break",)

    def places(self, drive: Drive) -> Iterable[str]:
        for shaft in moving_shafts(drive):
            law = shaft.friction.law
            if is_dry(shaft) and lacks(law, "stribeck") and not hasattr(plain_law(law), "tau_s"):
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        path, size = f"{place}.friction.added.stribeck", SHARE * clues.typical_torque[place]
        guess, speeds = stribeck_speed(clues, place)
        rise = StribeckRise(upwards(size), guess, EXPONENT)
        trials = tuple(Trial(({f"{path}.torque": size},), {f"{path}.omega_s": omega_s}) for omega_s in speeds)
        added = with_friction(drive, drive.shaft(place), stribeck=rise)
        return Augmentation(added, {f"{path}.torque": 0.0}, trials)

    def hiding(self, drive: Drive, place: str, clues: Clues) -> Hiding:
        """As large as the dry friction itself: breakaway at twice the Coulomb friction."""
        path, added = f"{place}.friction.added.stribeck", self.augment(drive, place, clues)
        element = fitted_friction(drive, place, clues)
        level = 0.5 * float(element.magnitude("positive", 0.0, 0.0) + element.magnitude("negative", 0.0, 0.0))
        tried = SHARE * clues.typical_torque[place]
        return Hiding(added, f"{path}.torque", f"{path}.omega_s", tried, level)

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        """Return the drive with another exponent or, if it has one already, with friction that goes on falling.

        Source: Hess & Soom 1990, whose curve ends like a power of the speed.
        """
        terms, path = added_terms(drive.shaft(place).friction.law), f"{place}.friction.added.stribeck"
        if terms is None or terms.stribeck is None or terms.stribeck.tail is not None:
            return None
        if terms.stribeck.delta == EXPONENT:
            name, off, on = "delta", EXPONENT, 0.9 * EXPONENT
            rise = replace(terms.stribeck, delta=Free(EXPONENT, 0.3, 6.0))
        else:
            name, off, on = "tail", 0.0, TAIL
            rise = replace(terms.stribeck, tail=Free(0.0, 0.0, 10.0 * TAIL))
        added = with_friction(drive, drive.shaft(place), stribeck=rise)
        return Augmentation(added, {f"{path}.{name}": off}, (Trial(({f"{path}.{name}": on},)),))


class PolylineBreakEffect(AbstractEffect):
    """The viscous slope changes at a speed."""

    name: ClassVar[str] = "polyline_break"
    sentence: ClassVar[str] = "the viscous slope changes at a speed"
    resembles: ClassVar[tuple[str, ...]] = ("stribeck",)

    def places(self, drive: Drive) -> Iterable[str]:
        for shaft in moving_shafts(drive):
            law = shaft.friction.law
            if not isinstance(plain_law(law), NoFriction) and lacks(law, "bend"):
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        path, fastest = f"{place}.friction.added.bend", max(clues.speed_quantiles(place, (0.98,))[0], 1e-12)
        slope = SHARE * clues.typical_torque[place] / fastest
        breaks = clues.speed_quantiles(place, (0.2, 0.35, 0.5, 0.65, 0.8, 0.9))
        bend = Bend(either_way(slope), Free(breaks[2], 0.02 * fastest, fastest))
        trials = tuple(Trial(({f"{path}.slope": slope},), {f"{path}.speed": speed}) for speed in breaks)
        added = with_friction(drive, drive.shaft(place), bend=bend)
        return Augmentation(added, {f"{path}.slope": 0.0}, trials, inside=(f"{path}.speed",))


class QuadraticDragEffect(AbstractEffect):
    """Friction curves with speed."""

    name: ClassVar[str] = "quadratic_drag"
    sentence: ClassVar[str] = "friction curves with speed: windage, churning, lubricant"

    def places(self, drive: Drive) -> Iterable[str]:
        for shaft in moving_shafts(drive):
            law = shaft.friction.law
            if not isinstance(plain_law(law), (NoFriction, Quadratic)) and lacks(law, "quadratic"):
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        path = f"{place}.friction.added.quadratic"
        size = SHARE * clues.typical_torque[place] / max(clues.speed_quantiles(place, (0.9,))[0], 1e-12) ** 2
        added = with_friction(drive, drive.shaft(place), quadratic=either_way(size))
        return Augmentation(added, {path: 0.0}, (Trial(({path: size},)),))


class AsymmetryEffect(AbstractEffect):
    """Friction differs by direction: Coulomb, viscous, and near standstill whatever the law has there."""

    name: ClassVar[str] = "asymmetry"
    sentence: ClassVar[str] = "Coulomb, viscous or breakaway friction differs by direction"

    def places(self, drive: Drive) -> Iterable[str]:
        for shaft in moving_shafts(drive):
            law = shaft.friction.law
            directional = any(isinstance(value, Directional) for value in vars(plain_law(law)).values())
            plain = not isinstance(plain_law(law), NoFriction) and not directional
            if plain and lacks(law, "coulomb") and lacks(law, "viscous"):
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        shaft, stem = drive.shaft(place), f"{place}.friction.added"
        size = SHARE * clues.typical_torque[place]
        whole, law = shaft.friction.law, plain_law(shaft.friction.law)
        sizes = {"coulomb": either_way(size)} if is_dry(shaft) else {}
        if viscous_part(whole) is not None or isinstance(law, Polyline):
            sizes["viscous"] = either_way(size / max(clues.speed_quantiles(place, (0.9,))[0], 1e-12))
        sizes |= {name: Free(UNEVEN, -MOST_UNEVEN, MOST_UNEVEN) for name in _near_standstill(whole)}
        terms: dict[str, Any] = {name: _odd(f"{stem}.{name}.positive", value) for name, value in sizes.items()}
        guesses = {f"{stem}.{name}.positive": value.guess for name, value in sizes.items()}
        if isinstance(law, (LuGre, Stribeck)):
            path = f"{stem}.stribeck.torque.positive"
            delta = _shared(law.delta, f"{place}.friction.delta")
            speed = _shared(law.omega_s, f"{place}.friction.omega_s")
            if "speed_share" in sizes:
                speed = _either(law.omega_s, f"{place}.friction.omega_s", f"{stem}.speed_share.positive")
            terms["stribeck"], guesses[path] = StribeckRise(_odd(path, either_way(size)), speed, delta), size
        trial = Trial(tuple({path: guess} for path, guess in guesses.items()))
        return Augmentation(with_friction(drive, shaft, **terms), dict.fromkeys(guesses, 0.0), (trial,))


def _near_standstill(law: AbstractFrictionLaw) -> list[str]:
    """Return the shares by which numbers of a law's curve and bristle near standstill may be larger one way."""
    parts = [plain_law(law), *([law.bristle] if isinstance(law, Bristled) else [])]
    there = [name for name in SHARES if any(not is_off(getattr(part, name, None)) for part in parts)]
    return [SHARES[name] for name in there if lacks(law, SHARES[name])]


def _shared(value: Value, path: str) -> Value:
    """Return a number that is what another one is, wherever that is fitted."""
    return Tie(path) if isinstance(value, (Free, Tie)) else value


def _either(value: Value, path: str, share: str) -> Directional:
    """Return a number, named by its path or plain, that is larger one way by a fitted share and smaller the other."""
    name = path if isinstance(value, (Free, Tie)) else repr(float(value))
    return Directional(Tie(f"{name} * (1 + {share})"), Tie(f"{name} * (1 - {share})"))


def _odd(path: str, size: Free) -> Directional:
    """Return a term that is added in one direction and taken off in the other."""
    return Directional(size, Tie(f"-1 * {path}"))

"""What to record where the recordings cannot tell candidates apart."""

from __future__ import annotations

from dataclasses import dataclass

from friction_ocp.diagnosis.diagnose import Diagnosis
from friction_ocp.effects.effect import Key
from friction_ocp.excitation.design import Design, Option, separating
from friction_ocp.excitation.trial_run import is_driven
from friction_ocp.execution.executor import AbstractExecutor, InProcess

_EXCITATION = {
    "stribeck": "speeds from well below to well above the Stribeck speed, slowly and in both directions",
    "polyline_break": "constant speeds on either side of the break, up to the fastest",
    "quadratic_drag": "constant speeds up to the fastest, in both directions",
    "asymmetry": "the same speeds in both directions over the same positions",
    "presliding": "small reversals that do not break away, torque rising and falling below breakaway",
    "load_dependence": "the same speeds under several loads",
    "warm_up": "the same motion cold and warm, with the temperature recorded",
    "backlash": "slow reversals with the load at rest and under load on one flank",
    "compliance": "a sweep through the resonance with both sides measured",
    "unbalance": "more than a turn of travel, slowly, in both directions",
    "constant_torque": "standstill and slow motion in both directions",
    "position_ripple": "slow constant speeds over several periods, in both directions",
    "cogging": "slow constant speeds over a turn of the motor",
    "structural_mode": "a sweep through the frequencies of the structure",
    "sensor_offset": "a rest in a known state with the drive off",
    "sensor_delay": "a fast sweep that separates a delay from compliance",
}
"""Motion that makes an effect visible, by effect."""


HOPELESS = 1.0
"""Expected squared distance, in noise floors, below which no motion separates rivals."""
EVEN = 0.5
"""Probability below which one recording more often than not decides nothing."""


@dataclass(frozen=True)
class FollowUp:
    """What to record next."""

    rivals: tuple[Key, ...]
    text: str
    design: Design | None
    """Motions within the limits, the one that separates the rivals best first; None where no command makes a motion."""

    @property
    def option(self) -> Option | None:
        """The motion to record; None where none separates the rivals."""
        best = self.design.options[0] if self.design is not None and self.design.options else None
        return best if best is not None and best.worth >= HOPELESS else None


def follow_up(diagnosis: Diagnosis, executor: AbstractExecutor = InProcess()) -> FollowUp | None:
    """Return what to record to separate the members of the first alias set, or set of what comes as near; or None."""
    sets = diagnosis.alias_sets or diagnosis.as_near
    if not sets:
        return None
    wanted = set(sets[0])
    done = next(item for item in diagnosis.rounds if wanted <= {rival.key for rival in item.choice.aliases})
    rivals = [rival for rival in done.choice.named if rival.key in wanted]
    keys = tuple(rival.key for rival in rivals)
    if not is_driven(done.before.model.problem.drive):  # a free decay, or a motion that is prescribed
        what = f"{_named(keys)} cannot be told apart here, and no command of a motor makes the motion"
        return FollowUp(keys, f"{what}. {_shown_by(_hints(keys))}", None)
    design = separating(done.before, [rival.fitted for rival in rivals], executor)
    found = FollowUp(keys, "", design)
    return FollowUp(keys, _text(keys, found.option), design)


def _text(keys: tuple[Key, ...], option: Option | None) -> str:
    named, hints = _named(keys), _hints(keys)
    if option is None:
        return (
            f"No motion within the limits tells {named} apart with these channels: they say the same in other words, "
            f"or a further sensor is needed. {_shown_by(hints)}"
        )
    power = option.power or 0.0
    motion = f"{option.run.motion.sentence}, up to {100 * option.run.amplitude:.0f} % of the allowed speed, as in "
    chance = "less than 1 %" if power < 0.01 else f"{100 * power:.0f} %"
    decides = f"next_experiment.h5: one recording decides with a probability of {chance}"
    if power < EVEN:
        return f"To tell {named} apart takes many recordings. The best motion: {motion}{decides}. {_shown_by(hints)}"
    return f"To tell {named} apart, record {motion}{decides}."


def _named(keys: tuple[Key, ...]) -> str:
    return " and ".join(_spoken(key) for key in keys)


def _hints(keys: tuple[Key, ...]) -> list[str]:
    return [f"{_EXCITATION[key[0]]} ({_spoken(key)})" for key in keys if key[0] in _EXCITATION]


def _shown_by(hints: list[str]) -> str:
    return f"What shows each by itself: {'; '.join(hints) or 'other loads'}."


def _spoken(key: Key) -> str:
    effect, place = key
    return f"{effect.replace('_', ' ')} at {place}"

"""One diagnosis against the truth: what it named, whether that is right, what it promised and how sure it was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Pair = tuple[str, str]
"""Effect and component."""
LARGEST_SET = 2
"""Members that an alias set may have and still be an answer."""
NAMING = ("explained", "undecided")
"""Verdicts that name causes."""
NO_EFFECT, OUTSIDE = "no_effect", "outside_catalogue"


@dataclass(frozen=True)
class Named:
    """What a diagnosis says, as far as it is judged."""

    verdict: str
    accepted: tuple[Pair, ...]
    sets: tuple[frozenset[Pair], ...]
    """What could be meant, in the order of the answer: each accepted effect with its alias set, then sets without."""
    alias_sets: tuple[frozenset[Pair], ...]
    probabilities: Mapping[str | Pair, float]
    """Of the first round."""
    promised: float | None
    """`gap.shrink.overall`."""
    seconds: float
    remainder: str | None


def pair(item: Mapping[str, Any]) -> Pair:
    """Return effect and component of an item of the result."""
    return str(item["effect"]), str(item["component"])


def named(result: Mapping[str, Any], seconds: float) -> Named:
    """Read the result of `diagnose`."""
    accepted = tuple(pair(item) for item in result["accepted"])
    aliases = tuple(frozenset(map(pair, members)) for members in result["alias_sets"])
    sets = [next((members for members in aliases if item in members), frozenset([item])) for item in accepted]
    sets += [members for members in aliases if not members & set(accepted)]
    shrink = (result.get("gap") or {}).get("shrink") or {}
    return Named(
        verdict=str(result["verdict"]),
        accepted=accepted,
        sets=tuple(sets),
        alias_sets=aliases,
        probabilities=_probabilities(result["rounds"]),
        promised=shrink.get("overall"),
        seconds=seconds,
        remainder=(result.get("remainder") or {}).get("component"),
    )


def _probabilities(rounds: Sequence[Mapping[str, Any]]) -> dict[str | Pair, float]:
    if not rounds:
        return {}
    first = rounds[0]
    found: dict[str | Pair, float] = {pair(cause): float(cause["probability"]) for cause in first["causes"]}
    return found | {name: float(first["probabilities"].get(name, 0.0)) for name in (NO_EFFECT, OUTSIDE)}


@dataclass(frozen=True)
class Judged:
    """One case with what was right about its diagnosis; None where the question does not arise."""

    case: str
    kind: str
    machine: str
    truth: tuple[str, ...]
    """Effects by name."""
    said: str
    """The first effect named, or the verdict where it names none."""
    cause: bool | None
    place: bool | None
    silent: bool | None
    """Without an effect: whether no gap was claimed."""
    unknown: bool | None
    """With one outside the catalogue: whether it was called unknown."""
    both: bool | None
    spurious: int
    alias_sizes: tuple[int, ...]
    probability: float
    """That the first round gave to what is true of it."""
    stated: tuple[tuple[float, bool], ...]
    """Probability and truth of everything that the first round considered."""
    promised: float | None
    seconds: float

    @property
    def right(self) -> bool:
        """Whether the answer as a whole is what it should be."""
        return bool({"none": self.silent, "outside": self.unknown, "two": self.both}.get(self.kind, self.cause))


def judge(answer: Mapping[str, Any], said: Named) -> Judged:
    """Compare an answer of the generator with what a diagnosis said."""
    kind = answer["kind"]
    truths = [frozenset(pair({"effect": e, "component": c}) for e, c in same) for same in answer["equivalents"]]
    in_catalogue = kind in ("one", "two")
    first = said.sets[0] if said.sets and len(said.sets[0]) <= LARGEST_SET else frozenset[Pair]()
    stated = _stated(kind, truths, said)
    return Judged(
        case=f"case-{answer['seed']}-{answer['index']:03d}",
        kind=kind,
        machine=answer["machine"],
        truth=tuple(item["effect"] for item in answer["planted"]),
        said=said.accepted[0][0] if said.accepted and said.verdict in NAMING else said.verdict,
        cause=_shares(first, truths, 0) if kind == "one" else None,
        place=_shares(first, truths, 1) if kind == "one" else None,
        silent=said.verdict == "no_gap" if kind == "none" else None,
        unknown=said.verdict == "unknown_effect" if kind == "outside" else None,
        both=all(_found(same, said) for same in truths) if kind == "two" else None,
        spurious=sum(_is_spurious(item, said, truths if in_catalogue else []) for item in said.accepted),
        alias_sizes=tuple(len(members) for members in said.alias_sets),
        probability=sum(value for value, true in stated if true),
        stated=stated,
        promised=said.promised if said.accepted else None,
        seconds=said.seconds,
    )


def _shares(members: frozenset[Pair], truths: Sequence[frozenset[Pair]], part: int) -> bool:
    """Whether a member agrees with a truth in effect (0) or component (1)."""
    return bool({item[part] for item in members} & {item[part] for same in truths for item in same})


def _found(same: frozenset[Pair], said: Named) -> bool:
    return any(members & same for members in said.sets if len(members) <= LARGEST_SET)


def _is_spurious(item: Pair, said: Named, truths: Sequence[frozenset[Pair]]) -> bool:
    meant = next(members for members in said.sets if item in members)
    return not any(meant & same for same in truths)


def _stated(kind: str, truths: Sequence[frozenset[Pair]], said: Named) -> tuple[tuple[float, bool], ...]:
    """Return what the first round thought of each possibility; equivalent ones are one."""
    true = {"none": {NO_EFFECT}, "outside": {OUTSIDE}}.get(kind, {item for same in truths for item in same})
    hit = sum(value for key, value in said.probabilities.items() if key in true)
    rest = [(value, False) for key, value in said.probabilities.items() if key not in true]
    return ((hit, True), *rest)

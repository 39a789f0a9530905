"""A diagnosis in words."""

from __future__ import annotations

from collections.abc import Sequence

from friction_ocp.effects.stated_values import STATED
from friction_ocp.plots.numbers import is_number, percent, significant, to_resolution, unit_text, whole_percent
from friction_ocp.plots.reading import Json, part, rows

NEARLY_ALL = 0.999
"""Share of the gap beyond which it is not told more closely."""
NOTABLE = 0.05
"""Probability from which it is told that an addition stands in for something unknown."""


def diagnosis_sentence(result: Json) -> str:
    """Say the verdict in one sentence or two."""
    accepted = [_explained(item) for item in rows(result, "accepted")]
    closed = part(part(result, "gap"), "shrink")
    match str(result.get("verdict")):
        case "no_gap":
            return "The model explains these recordings down to the noise: there is no gap to close."
        case "explained" | "undecided" as verdict if _but_for_stated_values(result):
            likely = "most likely " if verdict == "undecided" else ""
            known = "The model explains these recordings down to the noise, but not with the values that are stated"
            return f"{known}: {likely}{_listed(accepted)}."
        case "explained":
            return f"The model lacked {_listed(accepted)}{_stray(result) or f'; with it {_closed(closed)}.'}"
        case "undecided":
            likely = f"most likely {_listed(accepted)}{_stray(result) or f', with which {_closed(closed)}.'}"
            return f"There is a gap, and several causes fit it: {likely}"
        case _ if accepted and part(result, "remainder").get("parted_by_torque"):
            found = f"Explained in part: the model lacked {_listed(_with_rivals(result))}. {_one_step(result)}"
            why = f"they lack {_noise_of_torque(result)}, which slow torques show and which a loop has corrected"
            return f"{found}. Free runs come no closer: it may be that {why}. {_counted(result)}{_cut_short(result)}"
        case _ if accepted and not _lost(result) and not part(result, "remainder").get("carries_over", True):
            where = f"{_listed(_with_rivals(result))} explains part of it where the model was fitted"
            doubt = f"not on recordings left out, where {_closed(closed)}"
            cause = "The cause is probably another."
            told = f"There is a gap beyond the noise; {where}, but {doubt}."
            return f"{told}{_predicted(result) or f' {cause}'}{_cut_short(result)}"
        case _ if accepted:
            found, lost = f"Explained in part: the model lacked {_listed(_with_rivals(result))}", _lost(result)
            helped = f". {_one_step(result)}" if lost else f", with which {_closed(closed)}"
            left = f"what is left{_place(result)} is more than noise, and nothing in the catalogue explains it"
            runs = " Free runs say nothing here: on recordings left out they lead nowhere with or without it."
            told = f"{found}{helped}; {left}{_stand_ins(result)}.{runs if lost else ''}"
            return f"{told}{_predicted(result)}{_cut_short(result)}"
        case _:
            told = f"There is a gap beyond the noise{_place(result)}, and nothing in the catalogue explains it."
            return f"{told}{_torque_noise(result)}{_cut_short(result)}"


def _but_for_stated_values(result: Json) -> bool:
    """Whether the recordings showed no gap, and no more than stated values were found to be wrong."""
    if any(item["effect"] not in STATED for item in rows(result, "accepted")):
        return False
    shown = any(part(item, "excess")["p_value"] < result["significance"] for item in rows(result, "rounds"))
    return not shown and float(part(part(result, "gap"), "shrink")["interval95"][0]) <= 0.0


def _lost(result: Json) -> bool:
    """Whether free runs do not come closer and are lost in any case."""
    remainder = part(result, "remainder")
    return not remainder.get("carries_over", True) and bool(remainder.get("lost"))


def _one_step(result: Json) -> str:
    """Say what all that was added does for the errors of one-step predictions."""
    remainder = part(result, "remainder")
    before, after = (significant(remainder[key], 2) for key in ("ratio_before", "ratio"))
    return f"Errors of one-step predictions have {after} times the power of their noise with it, {before} times without"


def _predicted(result: Json) -> str:
    """Say that models were compared by short predictions, and what that leaves open."""
    if not result.get("by_predictions"):
        return ""
    why = "The simulation strays so far from the recordings that models were compared by short predictions"
    return f" {why} from the measured motion; errors of that motion are part of what is left."


def _stray(result: Json) -> str:
    """Say what additions do from sample to sample where free runs part by themselves, and do not come closer."""
    if not part(result, "remainder").get("stray"):
        return ""
    why = "noise of the start and of the inputs alone sets simulations of this drive as far apart"
    return f". {_one_step(result)}. Free runs say little here: {why}."


def _torque_noise(result: Json) -> str:
    """Say that what is left may be no more than noise of the torque, and how to have that counted."""
    if part(result, "remainder").get("as_torque_noise") is None:
        return ""
    told = "Errors of one-step predictions are no more than noise"
    return f" {told}: {_noise_of_torque(result)}, would leave as much. {_counted(result)}"


def _noise_of_torque(result: Json) -> str:
    remainder = part(result, "remainder")
    size = part(remainder, "torque_noise")
    much = f"about {significant(size['value'], 2)} {unit_text(size['unit'])}"
    return f"torque noise of {much} at {remainder['as_torque_noise']}, of which the file states none"


def _counted(result: Json) -> str:
    """Say how to have torque noise counted."""
    shaft = part(result, "remainder")["as_torque_noise"]
    told = f"Stated in the file as estimation: {{process_noise: {{{shaft}: ...}}}} it counts as noise"
    return f"{told}; identify with `estimate` there tells how much it is."


def _cut_short(result: Json) -> str:
    """Say that there was more to try, and how to have it tried."""
    if not result.get("cut_short"):
        return ""
    more = "a larger `effort` under `diagnosis:` (1 if none is stated) lets it go on"
    return f" The search ended at its limit of effort with more to try: {more}."


def _with_rivals(result: Json) -> list[str]:
    """Name every accepted effect, with those that the recordings cannot tell it from, or that come as near."""
    aliases, near = (
        [[_named(item) for item in members] for members in rows(result, key)] for key in ("alias_sets", "as_near")
    )
    found: list[str] = []
    for name in (_named(item) for item in rows(result, "accepted")):
        others, close = (
            [other for members in sets if members[0] == name for other in members[1:]] for sets in (aliases, near)
        )
        doubt = f" (or {' or '.join(others)}: these recordings cannot tell)" if others else ""
        doubt += f" ({' and '.join(close)} came as near)" if close else ""
        found.append(f"{name}{doubt}")
    return found


def _stand_ins(result: Json) -> str:
    """Say which accepted effects may stand in for what is not known; the doubt of a shape is not that of the effect."""
    doubts = {
        _named(part(item, "accepted")): float(part(item, "probabilities")["outside_catalogue"])
        for item in rows(result, "rounds")
        if item.get("accepted") and not item.get("reshaped")
    }
    worth = [f"{name} ({whole_percent(chance)})" for name, chance in doubts.items() if chance >= NOTABLE]
    return f". The same unknown cause may lie behind what was taken for {_listed(worth)}" if worth else ""


def round_sentence(item: Json) -> str:
    """Say what a round decided and how sure it is."""
    chances = part(item, "probabilities")
    none, outside = (whole_percent(chances[key]) for key in ("no_effect", "outside_catalogue"))
    accepted = part(item, "accepted")
    tried = any(cause.get("refit_gain") is not None for cause in rows(item, "causes"))
    why = ": no candidate is certain to help on recordings left out, and explains enough" if tried else ""
    added = "Given a more general shape" if item.get("reshaped") else "Added"
    decided, when = (
        (f"{added}: {_named(accepted)}.", "Before it") if accepted else (f"Nothing was added{why}.", "So far")
    )
    power = significant(part(item, "excess")["ratio"], 2)
    return (
        f"{decided} {when} the errors of one-step predictions have {power} times the power of their noise. "
        f"Probability that nothing is missing: {none}; that the cause is outside the catalogue: {outside}."
    )


def superseded_sentences(result: Json) -> list[str]:
    """Say what was added on the way and taken back."""
    taken = [_named(part(item, "accepted")) for item in rows(result, "superseded") if not item.get("reshaped")]
    kept = [_named(item) for item in rows(result, "accepted")]
    names = [name for name in dict.fromkeys(taken) if name not in kept]
    if not names:
        return []
    why = "what was found later explains the same" if kept else "nothing came nearer to the recordings left out"
    return [f"Added on the way and taken back, because {why}: {_listed(names)}."]


def alias_sentences(result: Json) -> list[str]:
    """Name the members of every alias set, and of every set of what comes as near where more than noise is left."""
    aliases, near = (
        [" or ".join(_named(item) for item in members) for members in rows(result, key)]
        for key in ("alias_sets", "as_near")
    )
    return [*aliases, *(f"{names}, none of which explains all" for names in near)]


def blind_spot_sentences(result: Json) -> list[str]:
    """Say which effects these recordings are too fast for."""
    return [_blind_spot(item) for item in rows(result, "cannot_tell")]


def _blind_spot(item: Json) -> str:
    speed, size = (f"{significant(part(item, key)['value'], 2)} {unit_text(part(item, key)['unit'])}" for key in _SPOT)
    return (
        f"{_named(item)}: these recordings cannot tell, where its speed is below {speed}; even {size} of it would stay "
        f"in the noise. Record below {speed}."
    )


_SPOT = ("record_below", "unseen")


def bias_sentences(result: Json) -> list[str]:
    """Say by how much each biased parameter had been off."""
    lines: list[str] = []
    for item in rows(result, "biased_parameters"):
        before, after = float(item["before"]), float(item["after"])
        unit = unit_text(str(item.get("unit", "")))
        off = ""
        if after * before > 0:
            off = f", {percent(abs(before / after - 1.0), 2)} too {'high' if before > after else 'low'}"
        error = _standard_error(item)
        sizes = f"{to_resolution(before, error)} {unit} before, {to_resolution(after, error)} {unit} after"
        lines.append(f"{item['name']}: {sizes}{off}")
    return lines


def _standard_error(item: Json) -> float | None:
    """Return the standard error of a parameter as its interval tells it."""
    low, high = (rows(item, "interval95") or [None, None])[:2]
    return (high - low) / (2.0 * 1.96) if is_number(low) and is_number(high) else None


def diagnosis_summary(result: Json) -> str:
    """Return a diagnosis in a few lines of plain text."""
    lines = [str(result["title"]), "", diagnosis_sentence(result), ""]
    for number, item in enumerate(rows(result, "rounds"), 1):
        lines.append(f"round {number}: {round_sentence(item)}")
        for cause in rows(item, "causes")[:3]:
            lines.append(f"  {_named(cause)}: probability {whole_percent(cause['probability'])}")
    lines += superseded_sentences(result)
    lines += [f"cannot be told apart: {line}" for line in alias_sentences(result)]
    lines += blind_spot_sentences(result)
    lines += [f"biased before: {line}" for line in bias_sentences(result)]
    following = result.get("next_experiment")
    return "\n".join([*lines, str(following["text"])] if following else lines)


def _named(item: Json) -> str:
    return f"{str(item['effect']).replace('_', ' ')} at {item['component']}"


def _explained(item: Json) -> str:
    meaning = item.get("meaning")
    return f"{_named(item)} ({meaning})" if meaning else _named(item)


def _place(result: Json) -> str:
    """Say where what is left shows."""
    component = part(result, "remainder").get("component")
    return f" at {component}" if component else ""


def _closed(closed: Json) -> str:
    """Say how much of the gap is gone where the candidate was not fitted, and when that is nothing to rely on."""
    overall, ends = float(closed["overall"]), [float(end) for end in closed["interval95"]]
    digits = 3 if ends[1] > 0.99 else 2
    low, high = (percent(end, digits) for end in ends)
    if ends[1] < 0.0:
        grown = f"{percent(-overall, 2)} ({percent(-ends[1], 2)} to {percent(-ends[0], 2)})"
        return f"the excess error on recordings left out grows by {grown}: do not rely on it"
    if ends[0] > NEARLY_ALL:
        return f"over {percent(NEARLY_ALL)} of the excess error is gone"
    doubt = "" if ends[0] > 0.0 else ", not certainly any"
    return f"{percent(overall, digits)} of the excess error is gone ({low} to {high}{doubt})"


def _listed(items: Sequence[str]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}" if items else "nothing"

"""A diagnosis as the document that result.json holds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from friction_ocp.diagnosis.additions import with_additions
from friction_ocp.diagnosis.bias import Bias, biased_parameters
from friction_ocp.diagnosis.blind_spots import BlindSpot
from friction_ocp.diagnosis.carried import carried
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.diagnose import Diagnosis, Round
from friction_ocp.diagnosis.excerpts import excerpts
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.free_gap import FreeErrors, gap_map
from friction_ocp.diagnosis.locate import Shape, shape
from friction_ocp.diagnosis.loop import opened
from friction_ocp.diagnosis.options import AT, considered
from friction_ocp.diagnosis.reading import corrections
from friction_ocp.diagnosis.rival import Rival
from friction_ocp.diagnosis.select import gave_shape, probabilities
from friction_ocp.diagnosis.worth import innovations, samples
from friction_ocp.drive.coordinates import ORDERS
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.units import signal_unit, unit_of
from friction_ocp.drive.values import drive_leaves
from friction_ocp.effects.effect import Key
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.horizon import horizon
from friction_ocp.estimation.noise import NoiseFloor
from friction_ocp.excitation.next_experiment import FollowUp
from friction_ocp.quantities import si_unit
from friction_ocp.result_document import heading, number, provenance

FORMAT = "friction-ocp-diagnosis/1"
MOST_SHAPES = 4
"""How often an effect may be given a more general shape, at most."""


def diagnosis_document(diagnosis: Diagnosis, following: FollowUp | None = None) -> dict[str, Any]:
    """Return the content of result.json for a diagnosis and what to record after it."""
    problem, part = diagnosis.problem, _searched(diagnosis)
    return {
        "format": FORMAT,
        "status": "diagnosed",
        **heading(problem),
        "verdict": diagnosis.verdict,
        "where": _where(diagnosis),
        "rounds": _rounds(diagnosis, diagnosis.rounds),
        "superseded": _rounds(diagnosis, diagnosis.superseded),
        "alias_sets": [[_named(key) for key in keys] for keys in diagnosis.alias_sets],
        "as_near": [[_named(key) for key in keys] for keys in diagnosis.as_near],
        "same_as": [[_named(key) for key in keys] for keys in diagnosis.same],
        "cannot_tell": [_blind_spot(item, problem.drive) for item in diagnosis.blind],
        "accepted": [{**_explained(key), "parameters": _added(diagnosis, key)} for key in diagnosis.accepted],
        "remainder": _remainder(diagnosis),
        "gap": _gap(diagnosis),
        "biased_parameters": [_bias(item) for item in biased_parameters(diagnosis.base, diagnosis.final)],
        "next_experiment": None if following is None else _next_experiment(following),
        "searched": part,
        "significance": diagnosis.level,
        "assumptions": _assumptions(diagnosis, part),
        "effort": diagnosis.effort,
        "cut_short": diagnosis.cut_short,
        "by_predictions": diagnosis.by_predictions,
        "seconds": diagnosis.seconds,
        "channel_units": _units(diagnosis),
        "provenance": provenance(problem, "diagnose"),
    }


def _searched(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Return what the search went by of long training recordings, s on their clocks; None of shorter ones: all."""
    model = diagnosis.base.model
    found = excerpts(model)
    if found is model.train:
        return None
    return {
        "samples": sum(item.grid.time.size for item in found),
        "of": sum(item.grid.time.size for item in model.train),
        "pieces": [
            {"recording": item.name, "from": float(item.grid.time[0]), "to": float(item.grid.time[-1])}
            for item in found
        ],
    }


def _named(key: Key) -> dict[str, str]:
    return {"effect": key[0], "component": key[1]}


def _explained(key: Key) -> dict[str, str]:
    return {**_named(key), "meaning": effects()[key[0]].sentence}


def _blind_spot(item: BlindSpot, drive: Drive) -> dict[str, Any]:
    motion = drive.shaft(item.component).motion
    return {
        **_explained((item.effect, item.component)),
        "record_below": {"value": item.below, "unit": si_unit("speed", motion)},
        "unseen": {"value": item.size, "unit": si_unit("torque", motion)},
    }


def _next_experiment(following: FollowUp) -> dict[str, Any]:
    option = following.option
    if option is None:
        return {"text": following.text, "separates": [_named(key) for key in following.rivals], "recording": None}
    return {
        "text": following.text,
        "separates": [_named(key) for key in following.rivals],
        "recording": "next_experiment.h5",
        "motion": option.run.motion.name,
        "amplitude": option.run.amplitude,
        "power": option.power,
        "separation": option.worth,
        "peaks": dict(option.run.peaks),
    }


def _units(diagnosis: Diagnosis) -> dict[str, str]:
    drive = diagnosis.problem.drive
    return {item.name: signal_unit(drive, item.measures) for item in drive.outputs}


def _where(diagnosis: Diagnosis) -> dict[str, Any]:
    cells = gap_map(diagnosis.base, diagnosis.before, diagnosis.after)
    components = list(dict.fromkeys(component for _, component in diagnosis.accepted))
    found = _shape(diagnosis, components) if diagnosis.gap else None
    return {
        "components": _possible(diagnosis, components) or ([] if diagnosis.rest is None else [diagnosis.rest]),
        "depends_on": None if found is None else _depends_on(found),
        "shape": None if found is None else _curve(found, diagnosis.problem.drive),
        "joint": _joint(diagnosis, components) if diagnosis.gap else None,
        "map": [
            {
                "component": cell.component,
                "channel": cell.channel,
                "recording": cell.recording,
                "regime": cell.regime,
                "before": number(cell.before),
                "after": number(cell.after),
            }
            for cell in cells
        ],
    }


def _depends_on(found: Shape) -> dict[str, Any]:
    comes_back = {} if found.period is None else {"period": found.period}
    return {"variable": found.variable, **comes_back, "share": found.share}


def _possible(diagnosis: Diagnosis, components: list[str]) -> list[str]:
    """Return accepted components, and those at which an accepted effect would be one and the same to all sensors."""
    elsewhere = [place for keys in diagnosis.same for effect, place in keys[1:] if effect == keys[0][0]]
    return list(dict.fromkeys([*components, *elsewhere]))


def _shape(diagnosis: Diagnosis, components: list[str]) -> Shape | None:
    """Return the shape of what the base model lacks, on an accepted component that is a shaft, else where it shows."""
    clues, after = clues_of(diagnosis.base), clues_of(diagnosis.final) if components else None
    shafts = [shaft.name for shaft in diagnosis.problem.drive.shafts]
    rest = [] if diagnosis.rest is None else [diagnosis.rest]
    wanted = [name for name in components if name in shafts] or ([] if components else rest or shafts)
    shapes = [found for found in (shape(clues, name, after) for name in wanted) if found is not None]
    return max(shapes, key=lambda found: found.share, default=None)


def _joint(diagnosis: Diagnosis, components: list[str]) -> dict[str, Any] | None:
    """Return what an accepted joint carries over its twist, with additions and without; None where none is accepted."""
    drive = diagnosis.final.model.problem.drive
    joints = [item for item in drive.transmissions if item.name in components and item.kinematic_error is None]
    if not joints:
        return None
    curve = carried(clues_of(diagnosis.base), clues_of(diagnosis.final), joints[0])
    if curve is None:
        return None
    motion = drive.shaft(joints[0].to_shaft).motion
    columns = {"at": curve.twist, "needed": curve.needed, "lower": curve.lower, "upper": curve.upper}
    columns |= {"after": curve.after} | ({} if curve.before is None else {"before": curve.before})
    numbers = {key: [number(float(value)) for value in values] for key, values in columns.items()}
    units = {"unit": si_unit("torque", motion), "twist_unit": si_unit("angle", motion)}
    return {"component": curve.component, **units, **numbers}


def _curve(found: Shape, drive: Drive) -> dict[str, Any]:
    columns = {"at": found.centre, "torque": found.torque, "lower": found.lower, "upper": found.upper}
    columns |= {} if found.taken is None else {"taken": found.taken}
    numbers = {key: [number(float(value)) for value in values] for key, values in columns.items()}
    motion, kind = drive.shaft(found.component).motion, found.variable.rpartition(".")[2]
    of = {"theta": "angle", "omega": "speed", "torque": "torque", "time": "time"}.get(kind)
    units = {"unit": si_unit("torque", motion), "variable_unit": si_unit(of, motion) if of else ""}
    return {"component": found.component, "variable": found.variable, **units, **numbers}


def _rounds(diagnosis: Diagnosis, rounds: Sequence[Round]) -> list[dict[str, Any]]:
    return [_round(diagnosis, item, gave_shape(rounds, k)) for k, item in enumerate(rounds)]


def _round(diagnosis: Diagnosis, item: Round, reshaped: bool) -> dict[str, Any]:
    gap = item.accepted is not None or item.excess.significant(diagnosis.level) or diagnosis.left_over
    available = max(item.before.objective - 0.5 * samples(item.before), 1e-300)
    pairs = zip(item.choice.rivals, item.choice.probabilities, strict=True)
    causes = [_cause(item, rival, chance, available) for rival, chance in pairs]
    refitted = {rival.key for rival in item.choice.rivals}
    rest = [seen for seen in item.screened if seen.key not in refitted]
    causes += [
        {
            **_explained(seen.key),
            "probability": 0.0,
            "predicted_gain": _share(seen.gain, available),
            "refit_gain": None,
            "heldout_gain": None,
            "p_value": seen.p_value,
            "parameters": {path: number(value) for path, value in seen.values.items()},
        }
        for seen in rest
    ]
    return {
        "probabilities": dict(probabilities(item.choice, gap)),
        "excess": {"ratio": item.excess.ratio, "p_value": item.excess.p_value},
        "accepted": None if item.accepted is None else _named(item.accepted.key),
        "reshaped": reshaped,
        "causes": causes,
    }


def _cause(item: Round, rival: Rival, chance: float, available: float) -> dict[str, Any]:
    own, heldout = _own(item.before, rival), float(np.sum(rival.gains))
    return {
        **_explained(rival.key),
        "probability": chance,
        "predicted_gain": _share(rival.screened.gain, available),
        "refit_gain": _share(item.before.objective - rival.standing.objective, available),
        "heldout_gain": None if math.isnan(heldout) else _share(heldout, available),
        "p_value": rival.screened.p_value,
        "parameters": {name: value for name, value in rival.standing.values.items() if name in own},
    }


def _own(before: FittedModel, rival: Rival) -> set[str]:
    """Return the parameters that an addition brings: new ones, or those whose stated values it takes back."""
    new = set(rival.standing.values) - set(before.values)
    if new:
        return new
    spaces = (before.model.space, rival.fitted.model.space)
    stated = [dict(zip(space.names, space.prior_std, strict=True)) for space in spaces]
    return {name for name, std in stated[0].items() if math.isfinite(std) and not math.isfinite(stated[1][name])}


def _share(gain: float, available: float) -> float:
    return float(np.clip(gain / available, -1.0, 1.0))


def _added(diagnosis: Diagnosis, key: Key) -> dict[str, Any]:
    """Return the final values of what an accepted effect added."""
    names = set[str]()
    for item in diagnosis.rounds:
        if item.accepted is not None and item.accepted.key == key:
            names |= _own(item.before, item.accepted)
    shapes = _of_all_shapes(diagnosis.base, key)
    drive = diagnosis.final.model.problem.drive
    units = {leaf.path: unit_of(leaf, drive) for leaf in drive_leaves(drive)}
    final = diagnosis.final.values
    names = {name for name in final if name in names or name.partition("@")[0] in shapes}
    return {name: {"value": final[name], "unit": units[name.partition("@")[0]]} for name in sorted(names)}


def _of_all_shapes(base: FittedModel, key: Key) -> set[str]:
    """Return the parameters that an effect adds to a base model in its more general shapes, which no round may tell."""
    drives = (base.model.problem.drive, with_additions(base, [key] * MOST_SHAPES))
    known, found = ({leaf.path for leaf in drive_leaves(drive)} for drive in drives)
    return found - known


def _remainder(diagnosis: Diagnosis) -> dict[str, Any]:
    last, component = diagnosis.rounds[-1], diagnosis.rest
    if component is None and diagnosis.left_over and last.screened:
        component = last.screened[0].component
    slow = [{"component": item.component, "ratio": item.ratio, "p_value": item.p_value} for item in diagnosis.slow]
    return {
        "significant": diagnosis.unexplained,
        "carries_over": diagnosis.carries_over,
        "stray": diagnosis.stray,
        "lost": diagnosis.lost,
        "component": component,
        "ratio": diagnosis.remainder.ratio,
        "ratio_before": innovations(diagnosis.base).ratio,
        "slow_torque": slow,
        "parted_by_torque": diagnosis.parted_by_torque,
        **_as_torque_noise(diagnosis),
    }


def _as_torque_noise(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the shaft whose torque noise, of which the file states none, may be all that is left, and how much it is.

    None where one-step predictions show more, or where nothing is left.
    """
    noise = diagnosis.torque_noise
    if noise is None or not diagnosis.unexplained or diagnosis.remainder.significant(diagnosis.level):
        return {"as_torque_noise": None}
    unit = f"{si_unit('torque', diagnosis.problem.drive.shaft(noise.component).motion)}/sqrt(Hz)"
    return {"as_torque_noise": noise.component, "torque_noise": {"value": noise.density, "unit": unit}}


def _gap(diagnosis: Diagnosis) -> dict[str, Any]:
    problem, model = diagnosis.problem, diagnosis.base.model
    closed = diagnosis.closed
    sources = {floor.source for floor in model.floors.values()}
    return {
        "evaluated_on": [use.file for use in (problem.validation or problem.train)],
        "horizon_s": horizon(model),
        "noise_source": sources.pop() if len(sources) == 1 else "mixed",
        "before": _table(diagnosis, diagnosis.before),
        "after": _table(diagnosis, diagnosis.after),
        "shrink": {
            "overall": number(closed.overall),
            "interval95": [number(end) for end in closed.interval95],
            **{name: number(value) for name, value in closed.by_channel.items()},
        },
        "own_values": {run.name: dict(run.own) for run in diagnosis.after.runs if run.own},
    }


def _table(diagnosis: Diagnosis, errors: FreeErrors) -> dict[str, Any]:
    floors: Mapping[str, NoiseFloor] = diagnosis.base.model.floors
    units = _units(diagnosis)
    ratios = np.sqrt(errors.ratios())
    return {
        name: {
            "rms": number(float(ratios[k]) * floors[name].std),
            "unit": units[name],
            "noise_ratio": number(float(ratios[k])),
            "noise_source": floors[name].source,
        }
        for k, name in enumerate(errors.channels)
    }


def _bias(item: Bias) -> dict[str, Any]:
    return {
        "name": item.name,
        "before": item.before,
        "after": item.after,
        "unit": item.unit,
        "interval95": [number(end) for end in item.interval95],
    }


def _assumptions(diagnosis: Diagnosis, part: dict[str, Any] | None) -> list[str]:
    foot = diagnosis.base.footing
    units = _units(diagnosis)
    lines = [
        f"{name}: noise floor {floor.std:.3g} {units.get(name, '')} ({floor.source})"
        for name, floor in diagnosis.base.model.floors.items()
    ]
    for shaft, density in foot.density.items():
        unit = si_unit("torque", diagnosis.problem.drive.shaft(shaft).motion)
        noise = f"torque noise {density:.3g} {unit}/sqrt(Hz)"
        lines.append(f"{shaft}: {noise}, from the measured inputs and what the file states")
    if diagnosis.stated is not None:
        lines += corrections(diagnosis.stated, diagnosis.problem) + opened(diagnosis.stated, diagnosis.problem)
    lines.append("noise floors may be off by 5 %: what changes the error by less is no gap")
    lines += sides(diagnosis.problem.drive)
    if part is not None:
        size, more = f"{part['samples']} of {part['of']} samples", "`samples` under `diagnosis:` takes more"
        lines.append(f"the search went by {size} of the training recordings, in {len(part['pieces'])} pieces: {more}")
    own = sorted({name.partition("@")[0] for name in diagnosis.final.values if "@" in name})
    if own:
        how = "one that is held out has what suits it, as it has a start of its own"
        lines.append(f"every recording has its own {', '.join(own)}: {how}")
    meant = considered(diagnosis.problem)
    left_out = [name for name in effects() if name not in meant.names]
    lines.append(f"the catalogue: {', '.join(meant.entries)}")
    left_out += [AT.join(key) for key in sorted(meant.excluded)]
    lines += [f"left out of the catalogue by the file: {', '.join(left_out)}"] if left_out else []
    return [*lines, *diagnosis.unexamined]


def sides(drive: Drive) -> list[str]:
    """Return what is assumed of sensors behind joints that are rigid in the model: which side they are on.

    While a joint is rigid that makes no difference, and logs in the units of the load often come from its motor.
    """
    lines = list[str]()
    shown = [channel for channel in drive.outputs if channel.signal in ORDERS]
    for joint in (item for item in drive.transmissions if item.rigid):
        behind = [channel.name for channel in shown if channel.part == joint.to_shaft]
        if behind and all(channel.part != joint.from_shaft for channel in shown):
            before = f"a sensor before it measures `{joint.from_shaft}`, with the ratio in its `gain`"
            lines.append(f"{', '.join(behind)}: behind {joint.name}, whose twist and play they show; {before}")
    return lines

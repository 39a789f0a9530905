"""The lines of the diagnosis, measured; `acceptance.py diagnosis` prints them.

The blind suite is run beforehand: its line reads `score.json` of the folder in FRICTION_OCP_BLIND, else of the newest
`results/blind-*`. EMPS and ODrive are read from FRICTION_OCP_EMPS and FRICTION_OCP_ODRIVE.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import emps
import gaps
import numpy as np
from checks import Check
from gaps import Named, diagnosed
from servo import ROOT
from users import tests_check

from friction_ocp.diagnosis.bias import biased_parameters
from friction_ocp.diagnosis.free_gap import FreeErrors
from friction_ocp.effects.registry import effects

BLIND = "FRICTION_OCP_BLIND"
MOST_ERROR = 0.0527
"""rad, mean absolute error of the servo on validation."""
FEWEST = {"one": 100, "none": 60}
"""Cases of a kind that a report of the blind suite takes."""
LOW_SPEED_RUNS = 3


def _folder() -> Path:
    return Path(tempfile.mkdtemp())


def blind_suite(line: str, quick: bool) -> Check:
    """Read the score of the blind suite."""
    given = os.environ.get(BLIND)
    found = (
        [Path(given)] if given else sorted((ROOT / "results").glob("blind-*"), key=lambda item: item.stat().st_mtime)
    )
    stored = [item / "score.json" for item in found if (item / "score.json").is_file()]
    if not stored:
        return Check(line, "no score: run problems/blind/score.py --seed YYYYMMDD first", None)
    score = json.loads(stored[-1].read_text(encoding="utf-8"))
    counts = {kind: sum(case["kind"] == kind for case in score["cases"]) for kind in FEWEST}
    rows = [score["title"], *(f"{_word(item['passed'])} {item['what']}: {item['measured']}" for item in score["lines"])]
    enough = "(report)" in score["title"] and all(counts[kind] >= fewest for kind, fewest in FEWEST.items())
    held = enough and all(item["passed"] is not False for item in score["lines"])
    if not enough:
        rows.append(f"{counts['one']} cases with an effect and {counts['none']} without are too few, or no report")
    return Check(line, "\n".join(rows), held)


def _word(passed: bool | None) -> str:
    return {True: "ok", False: "NO", None: "  "}[passed]


def telescopes(line: str, quick: bool) -> Check:
    """Diagnose the Leighton telescope with each kind of friction, and ARIES with each left out."""
    told: list[str] = []
    wanted = {"high": ("polyline_break", "motor"), "low": ("polyline_break", "load")}
    wanted |= {"quadratic": ("quadratic_drag", "motor")}
    marks: list[bool] = []
    for kind, key in wanted.items():
        seen = diagnosed(f"LTO, {kind}", gaps.lto(kind, _folder()))
        marks.append(seen.names(*key))
        told.append(seen.told)
    for effect in () if quick else ("stribeck", "presliding", "asymmetry"):
        seen = diagnosed(f"ARIES without {effect}", gaps.aries_axis(effect, _folder()))
        marks.append(seen.names(effect, "axis"))
        told.append(seen.told)
    text, held = _too_fast_for_stribeck()
    return Check(line, "\n".join([*told, text]), all([*marks, held]) and (None if quick else True))


def _too_fast_for_stribeck() -> tuple[str, bool]:
    """Read up to which speed Stribeck friction would hide, then hide some below and show some above that."""
    seen = diagnosed("LTO, no slow points", gaps.lto("high", _folder()))
    spot = next((item for item in seen.found.blind if (item.effect, item.component) == STRIBECK), None)
    if spot is None:
        return f"{seen.told}; nothing is said about Stribeck at the motor", False
    slower, faster = (
        diagnosed(f"with {spot.size:.2g} N m at {speed:.2g} rad/s", gaps.lto_with_rise(spot.size, speed, _folder()))
        for speed in (0.5 * spot.below, 2.0 * spot.below)
    )
    told = f"{seen.told}; cannot tell Stribeck at the motor, record below {spot.below:.2g} rad/s"
    held = [STRIBECK in item.found.accepted for item in (seen, slower, faster)] == [False, False, True]
    return "\n".join([told, slower.told, faster.told]), held


STRIBECK = ("stribeck", "motor")


def real_machines(line: str, quick: bool) -> Check:
    """Diagnose the servo, EMPS and the ODrive."""
    parts = [_emps(), _odrive()] if quick else [_servo(), _emps(), _odrive()]
    known = [passed for _, passed in parts if passed is not None]
    passed = all(known) if len(known) == len(parts) else (False if False in known else None)
    return Check(line, "\n".join(text for text, _ in parts), passed)


def _servo() -> tuple[str, bool]:
    seen = diagnosed("xl330", ROOT / "problems" / "xl330" / "coulomb_viscous.yaml")
    error = mean_absolute(seen.found.after)
    accepted = [effect for effect, _ in seen.found.accepted]
    alias = [{effect for effect, _ in one} for one in seen.sets]
    text = f"{seen.told}; validation error {mean_absolute(seen.found.before):.4f} -> {error:.4f} rad"
    named = "load_dependence" in accepted or {"load_dependence", "warm_up"} in alias
    return text, named and error <= MOST_ERROR


def mean_absolute(errors: FreeErrors) -> float:
    """Return the mean absolute error of the first channel over all free runs."""
    return float(np.nanmean(np.concatenate([np.abs(run.simulated[:, 0] - run.measured[:, 0]) for run in errors.runs])))


def _emps() -> tuple[str, bool | None]:
    if emps.VARIABLE not in os.environ:
        return "EMPS: no data", None
    folder = _folder()
    emps.convert_folder(Path(os.environ[emps.VARIABLE]), folder)
    problem = folder / "problem.yaml"
    problem.write_text((emps.PROBLEMS / "force_driven.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    seen = diagnosed("EMPS", problem)
    before, after = (emps.force_errors(_by_direction(item), folder) for item in (seen.found.base, seen.found.final))
    text = ", ".join(f"{100 * one:.2f} -> {100 * two:.2f} %" for one, two in zip(before, after, strict=True))
    named = any("asymmetry" in {effect for effect, _ in one} for one in seen.sets)
    return f"{seen.told}; force error {text}", named and after[0] < before[0]


def _by_direction(fitted: object) -> dict[str, float]:
    """Return the values of a fit with those that differ by direction spelled out."""
    values = dict(fitted.values)  # type: ignore[attr-defined]
    for key, added in (("tau_c", "coulomb"), ("viscous", "viscous")):
        more = values.get(f"carriage.friction.added.{added}.positive")
        if more is not None:
            plain = values.pop(f"carriage.friction.{key}")
            values |= {f"carriage.friction.{key}.{way}": plain + sign * more for way, sign in _WAYS}
    return values


_WAYS = (("positive", 1.0), ("negative", -1.0))


def _odrive() -> tuple[str, bool | None]:
    paths = {kind: gaps.odrive(kind, _folder()) for kind in ("nocomp", "comp")}
    seen = {kind: diagnosed(f"ODrive {kind}", path) for kind, path in paths.items() if path is not None}
    if not seen:
        return "ODrive: no data", None
    named = {kind: _cogging(one) for kind, one in seen.items()}
    return "\n".join(one.told + _wave(one) for one in seen.values()), named["nocomp"] and not named["comp"]


def _cogging(seen: Named) -> bool:
    return ("cogging", "motor") in seen.found.accepted


def _wave(seen: Named) -> str:
    """Return period and size of every wave that was added."""
    values = seen.found.final.values
    stems = [key.removesuffix(".period") for key in values if key.endswith(".period")]
    sizes = {stem: float(np.hypot(values[f"{stem}.cosine"], values[f"{stem}.sine"])) for stem in stems}
    return "".join(f"; {stem}: {size:.3g} over {values[f'{stem}.period']:.4g}" for stem, size in sizes.items())


def harmonic_drive(line: str, quick: bool) -> Check:
    """Diagnose a compliant reducer that the model has as rigid with a free delay."""
    seen = diagnosed("harmonic drive", gaps.harmonic_drive(_folder()))
    delays = [item for item in biased_parameters(seen.found.base, seen.found.final) if item.name.endswith(".delay")]
    told = [f"{item.name} {1e3 * item.before:.3f} ms before, {1e3 * item.after:.3f} ms after" for item in delays]
    held = seen.names("compliance", "motor-joint") and seen.found.verdict == "explained"
    return Check(line, "; ".join([seen.told, *told]), held and bool(delays) and delays[0].interval95[0] <= 0.0)


def no_gap(line: str, quick: bool) -> Check:
    """Diagnose creeping motion with a model that lacks nothing."""
    runs = [diagnosed(f"seed {k}", gaps.slow_motion(_folder(), k)) for k in range(1 if quick else LOW_SPEED_RUNS)]
    return Check(line, "\n".join(seen.told for seen in runs), all(seen.found.verdict == "no_gap" for seen in runs))


def every_effect(line: str, quick: bool) -> Check:
    """Run the test of every effect; which of them has none is told."""
    text = (ROOT / "tests" / "diagnosis" / "effect_cases.py").read_text(encoding="utf-8")
    page = (ROOT / "problems" / "effects" / "README.md").read_text(encoding="utf-8")
    untested = [name for name in effects() if f'"{name}": EffectCase(' not in text]
    unseen = [name for name in effects() if f"\n## {name}\n" not in page]
    missing = [*untested, *unseen]
    told = [
        f"without a case in tests/diagnosis/effect_cases.py: {', '.join(untested) or 'none'}",
        f"without a section in problems/effects/README.md: {', '.join(unseen) or 'none'}",
    ]
    if quick:
        return Check(line, "\n".join(told), False if missing else None)
    ran = tests_check(line, "tests/diagnosis/test_effects_found.py")
    return Check(line, "\n".join([*told, ran.measured, "pages are looked at by eye"]), bool(ran.passed and not missing))


MEASURES: Mapping[str, Callable[[str, bool], Check]] = {
    "blind_suite": blind_suite,
    "telescopes": telescopes,
    "real_machines": real_machines,
    "harmonic_drive": harmonic_drive,
    "no_gap": no_gap,
    "every_effect": every_effect,
}
"""By ID in done_when.yaml."""

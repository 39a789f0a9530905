"""Run a diagnosis from outside, as anybody would, and what checks its promises: fresh recordings, noise-free rivals."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import friction_ocp as fo
from blind.arithmetic import shrinkage
from blind.cases import Case, write_fresh, write_quiet
from blind.folder import write_json, write_text
from blind.judging import Pair

TIME_LIMIT = 900.0
"""Seconds after which a diagnosis is given up: five times what is allowed."""


class Failed(Exception):
    """A command of the toolkit ended without a result."""


def command(*arguments: str | Path, limit: float = TIME_LIMIT) -> None:
    """Run a command of the toolkit; raises Failed with what it said."""
    words = [sys.executable, "-m", "friction_ocp", *map(str, arguments)]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        raise Failed(f"no answer within {limit:.0f} s") from None
    if done.returncode != 0:
        said = done.stdout.splitlines()[-3:] + done.stderr.splitlines()[-5:]
        raise Failed(f"exit status {done.returncode}: {' | '.join(said)}")


def diagnosed(problem: Path, folder: Path, workers: int = 2) -> tuple[dict[str, Any], float]:
    """Return the result of `diagnose` and its time, s; what is on disk is not run again."""
    timing = folder / "timing.json"
    if not timing.exists():
        began = time.perf_counter()
        command("diagnose", problem, "--out", folder, "--workers", str(workers))
        write_json(timing, {"seconds": time.perf_counter() - began})
    return _json(folder / "result.json"), float(_json(timing)["seconds"])


def fitted_base(problem: Path, diagnosis: Path, folder: Path) -> Path:
    """Return the base model with its answer: as the diagnosis left it, else identified here."""
    if (diagnosis / "base.yaml").exists():
        return diagnosis / "base.yaml"
    fitted = folder / "fitted.yaml"
    if not fitted.exists():
        command("identify", problem, "--out", folder)
    return fitted


def reached(case: Case, result: Mapping[str, Any], base: Path, augmented: Path, folder: Path) -> float | None:
    """Return the share of the excess that is gone on recordings of the same machine that nobody has seen.

    Raises Failed where a model that the diagnosis left cannot be simulated.
    """
    fresh = write_fresh(case, folder)
    horizon = result["gap"]["horizon_s"]
    try:
        ratios = [_noise_ratios(model, fresh, horizon, folder / f"{model.stem}.yaml") for model in (base, augmented)]
    except fo.FrictionOcpError as error:
        raise Failed(f"its model cannot be simulated: {error}") from None
    return shrinkage(*ratios)


def _noise_ratios(model: Path, recordings: Sequence[Path], horizon: float | None, target: Path) -> list[float]:
    """Return the noise ratio of each channel when a model runs freely on recordings."""
    content = yaml.safe_load(model.read_text(encoding="utf-8"))
    content["recordings"] = {"train": [str(path.resolve()) for path in recordings]}
    if horizon is not None:
        content["estimation"] = {**content.get("estimation", {}), "horizon_s": horizon}
    write_text(target, yaml.safe_dump(content, sort_keys=False))
    simulation = fo.simulate(fo.load_problem(target))
    return [errors.noise_ratio for errors, _ in simulation.train_errors.values()]


def confirmed(case: Case, problem: Path, accepted: Sequence[Pair], rival: Pair, leader: Pair, folder: Path) -> bool:
    """Whether a rival stands in for the leader of its alias set: refitted to noise-free data it stays under the noise.

    The diagnosis is asked again about the recordings as they would be without noise, with the rival for the leader and
    what else was accepted as all that it may add. The floors stay as stated. Where the model stays under them even
    without the rival, that is not added; with it the model would be no farther off.
    """
    content = yaml.safe_load(problem.read_text(encoding="utf-8"))
    quiet = write_quiet(case, folder)
    copies = [path.with_name(path.name.replace("train", "check")) for path in quiet]
    for path, copy in zip(quiet, copies, strict=True):
        copy.write_bytes(path.read_bytes())
    content["recordings"] = {"train": [path.name for path in quiet], "validation": [path.name for path in copies]}
    others = sorted({effect for effect, component in accepted if (effect, component) != leader})
    content["diagnosis"] = {"effects": [" at ".join(rival), *others]}
    write_text(folder / "problem.yaml", yaml.safe_dump(content, sort_keys=False))
    try:
        result, _ = diagnosed(folder / "problem.yaml", folder / "-".join(rival))
    except Failed:
        return False
    return bool(np.max([channel["noise_ratio"] for channel in result["gap"]["after"].values()]) < 1.0)


def _json(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))

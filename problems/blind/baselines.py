"""What anybody could do instead, on the same cases: correlate errors with features, or fit every model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import friction_ocp as fo
from blind import correlation
from blind.folder import write_text
from blind.judging import Pair

CORRELATION, EVERY_MODEL = "correlation of errors with features", "lowest left-out error of every model"
CHOICES = {"none": (), "correlation": (CORRELATION,), "all": (CORRELATION, EVERY_MODEL)}


def baselines_right(names: Sequence[str], base: Path, problem: Path, answer: Mapping[str, Any]) -> dict[str, bool]:
    """Return whether each of the named baselines finds the effect of a case, or none where there is none."""
    fitted = fo.load_problem(_beside(base, problem))

    def said(name: str) -> Pair | None:
        if name == EVERY_MODEL:
            from blind import every_model

            return every_model.answer(fitted)
        return correlation.answer(fitted, np.random.default_rng(answer["index"]))

    return {name: is_right(answer, said(name)) for name in names}


def is_right(answer: Mapping[str, Any], said: Pair | None) -> bool:
    """Whether an answer names the hidden effect, wherever it puts it, or nothing where nothing is hidden."""
    true = {effect for same in answer["equivalents"] for effect, _ in same}
    return said is None if answer["kind"] == "none" else said is not None and said[0] in true


def _beside(base: Path, problem: Path) -> Path:
    """Write the fitted base model beside its recordings, whose paths are relative to the problem; return its path."""
    content = yaml.safe_load(base.read_text(encoding="utf-8"))
    content["recordings"] = yaml.safe_load(problem.read_text(encoding="utf-8"))["recordings"]
    target = problem.with_name("base.yaml")
    write_text(target, yaml.safe_dump(content, sort_keys=False))
    return target

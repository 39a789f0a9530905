"""A small problem about the recorded servo: one recording for training, one for validation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

REPOSITORY = Path(__file__).parents[1]
SERVO_PROBLEMS = REPOSITORY / "problems" / "xl330"
STEP = 0.002
"""Integrator step, s: the same for every guess, which the problem files leave to the toolkit."""


def servo_document(model: str = "coulomb_viscous", **estimation: Any) -> dict[str, Any]:
    """Return the content of a problem file, for a file in any folder; estimation options may be changed."""
    document: dict[str, Any] = yaml.safe_load((SERVO_PROBLEMS / f"{model}.yaml").read_text(encoding="utf-8"))
    data = REPOSITORY / "data" / "xl330"
    document["drive"]["motor"]["torque_constant"] = 0.38
    document["recordings"] = {
        "train": [{"file": str(data / "sin_sin-kp100.h5"), "set": {"controller.kp": 0.287737750}}],
        "validation": [{"file": str(data / "sin_sin-kp400.h5"), "set": {"controller.kp": 1.150951001}}],
    }
    document["estimation"] |= {"max_step": STEP, **estimation}
    return document


def write_servo(folder: Path, model: str = "coulomb_viscous", **estimation: Any) -> Path:
    """Write the problem into a folder."""
    return write_problem(folder / "servo.yaml", servo_document(model, **estimation))


def write_problem(path: Path, document: dict[str, Any]) -> Path:
    """Write a problem file."""
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path

"""What a problem holds, in one sentence: for the eye to see whether that is what was meant."""

from __future__ import annotations

from collections.abc import Sequence

from friction_ocp.drive.values import drive_leaves
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.parameters import Free


def summary(problem: Problem) -> str:
    """Return shafts with their friction laws, signals in and out, what is fitted, and the samples to do it with."""
    drive = problem.drive
    shafts = [f"{item.name} ({item.friction.law.name})" for item in drive.shafts]
    inputs, outputs = (", ".join(item.measures for item in channels) for channels in (drive.inputs, drive.outputs))
    fitted = [leaf.path for leaf in drive_leaves(drive) if isinstance(leaf.value, Free)]
    parts = [
        f"shafts: {', '.join(shafts)}",
        f"in: {inputs or 'nothing'}",
        f"out: {outputs or 'nothing'}",
        f"fitted: {', '.join(fitted) or 'nothing'}",
        *_amount(problem.train, "to train"),
        *_amount(problem.validation, "to validate"),
    ]
    points = sum(use.points.speed.size for use in (*problem.static, *problem.static_validation))
    return "; ".join([*parts, f"{points} static points"] if points else parts)


def _amount(uses: Sequence[RecordingUse], purpose: str) -> list[str]:
    if not uses:
        return []
    samples = sum(max((one.time.size for one in use.recording.channels.values()), default=0) for use in uses)
    return [f"{samples} samples in {len(uses)} recording{'s' * (len(uses) > 1)} {purpose}"]

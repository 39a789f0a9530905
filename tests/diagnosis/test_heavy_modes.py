"""Most of an inertia that hangs on a spring, of which a small part tells nothing."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import yaml
from diagnosis_cases import INERTIA, write_case
from effect_cases import hung

from friction_ocp.diagnosis import refit
from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.problem_file.load import load_problem

HUNG, RATE = 0.75, 2.0 * np.pi * 9.0
"""Share of the inertia on the spring, and its frequency while the motor stands still, rad/s."""


@pytest.mark.slow
def test_most_of_a_stated_inertia_is_found_on_a_spring(tmp_path: Path) -> None:
    """The file states the whole inertia as known; what hangs is told from it, and nothing else is blamed."""
    path = write_case(
        tmp_path, hung(HUNG, RATE), effects=["structural_mode", "inertia_error", "drive_lag", "sensor_delay"]
    )
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["shafts"][0]["inertia"] = INERTIA
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    found = diagnose(load_problem(path))
    assert found.accepted == (("structural_mode", "motor"),)
    values = found.final.values
    assert values["motor_mode.inertia"] == pytest.approx(HUNG * INERTIA, rel=0.02)
    assert values["motor.inertia"] == pytest.approx((1.0 - HUNG) * INERTIA, rel=0.02)
    assert values["motor-motor_mode.stiffness"] == pytest.approx(HUNG * INERTIA * RATE**2, rel=0.02)


@pytest.mark.parametrize(
    ("missed", "small", "large"),
    [(6.0, 580.0, True), (6.0, 150.0, False), (60.0, 580.0, True), (1.0, 600.0, False)],
)
def test_a_large_effect_is_tried_where_a_small_one_leaves_most(
    monkeypatch: pytest.MonkeyPatch, missed: float, small: float, large: bool
) -> None:
    """Whether or not the model has gone astray; not where there is only noise, or a small one takes most of it."""
    ends, values = {"small": small, "large": 90.0}, {"mode": 0.7}
    monkeypatch.setattr(refit, "with_drive", lambda model, drive: None)
    monkeypatch.setattr(refit, "contrast", lambda model, base, drive: None)
    monkeypatch.setattr(refit, "_launches", lambda *known: ["small"])
    monkeypatch.setattr(refit, "_point", lambda base, model, built, wanted: "large" if wanted == values else "other")
    monkeypatch.setattr(refit, "_steps", lambda base, model, program, point: SimpleNamespace(objective=ends[point]))
    monkeypatch.setattr(refit, "timed", lambda fitted, tolerances: fitted)
    footing = SimpleNamespace(training=lambda model: None, segment_s=0.1)
    base = SimpleNamespace(
        model=None, linear=None, footing=footing, objective=600.0, missed=missed, astray=False, lost=False, values={}
    )
    augmentation = SimpleNamespace(drive=None, off={}, outright=(), otherwise=None, large=lambda added: values)
    start = SimpleNamespace(added=lambda off: {"mode": 0.01})
    item: Any = SimpleNamespace(augmentation=augmentation, starts=(start,), gain=1.0)
    found = refit.quick_refit(cast(Any, base), item)
    assert found.objective == (ends["large"] if large else small)

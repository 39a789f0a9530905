"""What counts as lost, where free runs are to show whether an addition matters."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.diagnosis.free_gap import FreeErrors
from friction_ocp.estimation.score import FreeRun

FLOOR = 0.01


@pytest.mark.parametrize(("error", "lost"), [(0.005, False), (0.3, False), (1.5, True)])
def test_a_run_is_lost_where_the_mean_would_be_nearer(error: float, lost: bool) -> None:
    """A free run that misses a sine by more than the sine's own deviation says nothing of what the model lacks."""
    time = np.linspace(0.0, 1.0, 400)
    measured = np.sin(2.0 * np.pi * time)[:, None]
    run = FreeRun("a", time, measured, measured + error, np.zeros((400, 2)), {})
    power, count = np.array([[400.0 * (error / FLOOR) ** 2]]), np.array([[400.0]])
    assert FreeErrors((run,), ("position",), np.array([FLOOR]), power, count).lost is lost

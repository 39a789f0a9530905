"""Scores that a sweep sums while it simulates equal those of its outputs and their derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sweep_cases import DRIVES, Case

from friction_ocp.simulation.interpreted import InterpretedKernel
from friction_ocp.simulation.kernel import Piece, SweepRequest, SweepResult, Yardstick, empty_result
from friction_ocp.simulation.losses import Absolute, AbstractLoss, Huber, Squares, StudentT
from friction_ocp.simulation.sweep import Sweep

LOSSES = (Squares(), Absolute(0.3), Huber(), StudentT())


def compared(case: Case, loss: AbstractLoss) -> tuple[SweepRequest, SweepRequest]:
    """Return a request and the same one compared with noisy samples, of which some are missing."""
    request = case.request(np.random.default_rng(8))
    rng = np.random.default_rng(9)
    shape = (request.grid.time.size, len(case.model.output_names))
    measured = np.where(rng.random(shape) < 0.8, 0.5 * rng.standard_normal(shape), np.nan)
    return request, replace(request, yardstick=Yardstick(measured, 0.2 + rng.random(shape[1]), loss))


def expected(request: SweepRequest, by: Yardstick, plain: SweepResult) -> list[np.ndarray]:
    """Return cost, gradient and square of each segment, sample by sample."""
    assert plain.dy is not None
    segments, columns = len(request.first) - 1, plain.dy.shape[2]
    cost, gradient = np.zeros(segments), np.zeros((segments, columns))
    square = np.zeros((segments, columns, columns))
    for k, (sample, y, dy) in enumerate(zip(by.measured, plain.y, plain.dy, strict=True)):
        j = min(int(np.searchsorted(request.first, k, side="right")) - 1, segments - 1)
        for i in np.flatnonzero(np.isfinite(sample)):
            error, slope = (y[i] - sample[i]) / by.noise[i], dy[i] / by.noise[i]
            cost[j] += by.loss.cost(error)
            gradient[j] += by.loss.weight(error) * error * slope
            square[j] += by.loss.weight(error) * np.outer(slope, slope)
    return [cost, gradient, square]


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: type(loss).__name__)
def test_score_is_that_of_the_outputs(name: str, loss: AbstractLoss) -> None:
    """Both kernels, every loss, with and without derivatives."""
    case = Case(DRIVES[name]())
    sweep = Sweep(case.model, case.active)
    request, scored = compared(case, loss)
    assert scored.yardstick is not None
    wanted = expected(request, scored.yardstick, sweep.run_many([request])[0])
    interpreted = empty_result(scored, len(case.model.state_names), len(case.model.output_names), len(case.active))
    InterpretedKernel(case.model, case.active).run([Piece(scored, interpreted)])
    for result in (sweep.run_many([scored])[0], interpreted):
        score = result.score
        assert score is not None and result.dy is None
        for found, value in zip((score.cost, score.gradient, score.square), wanted, strict=True):
            np.testing.assert_allclose(found, value, rtol=0, atol=1e-9 * np.max(np.abs(value)))
    value_only = sweep.run_many([replace(scored, derivatives=False)])[0].score
    assert value_only is not None and value_only.square is None
    np.testing.assert_allclose(value_only.cost, wanted[0], rtol=1e-9)

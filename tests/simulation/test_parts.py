"""What is simulated side by side, and in which parts, changes no answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sweep_cases import DRIVES, Case

from friction_ocp.simulation import parts
from friction_ocp.simulation.compiled import compiler
from friction_ocp.simulation.kernel import Score, SweepRequest, SweepResult, Yardstick
from friction_ocp.simulation.losses import Squares
from friction_ocp.simulation.sweep import Sweep

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

ROUNDING = 1e-9
"""Of sensitivities that are multiplied part by part, relative to the largest."""


def arrays(result: SweepResult | Score) -> dict[str, np.ndarray]:
    """Return all arrays of a result by name."""
    return {name: value for name, value in vars(result).items() if isinstance(value, np.ndarray)}


def long_request(case: Case, seed: int, scored: bool) -> SweepRequest:
    """Return three segments of thousands of steps, whose outputs are compared or kept."""
    request = case.request(np.random.default_rng(seed), width=0.0)
    fine = replace(request, grid=replace(request.grid, substeps=request.grid.substeps * 40))
    samples = np.random.default_rng(seed).standard_normal((request.grid.time.size, len(case.model.output_names)))
    by = Yardstick(samples, np.ones(samples.shape[1]), Squares())
    return replace(fine, yardstick=by if scored else None)


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("scored", [False, True])
def test_parts_are_the_whole(name: str, scored: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sensitivities and scores by the chain rule over parts are those of one pass."""
    case = Case(DRIVES[name]())
    sweep, request = Sweep(case.model, case.active), long_request(case, 3, scored)
    single = replace(request, first=request.first[[0, -1]], x0=request.x0[:1])
    for item in (request, single):
        in_parts = sweep.run_many([item])[0]
        with monkeypatch.context() as patched:
            patched.setattr(parts, "MOST_PARTS", 1)
            whole = sweep.run_many([item])[0]
        assert in_parts.dend is not None and not np.array_equal(in_parts.dend, arrays(whole)["dend"])
        pairs = [(in_parts, whole)]
        pairs += [(in_parts.score, whole.score)] if in_parts.score and whole.score else []
        for one, other in pairs:
            for key, value in arrays(other).items():
                scale = np.max(np.abs(value))
                np.testing.assert_allclose(arrays(one)[key], value, rtol=0, atol=ROUNDING * scale, err_msg=key)


@pytest.mark.parametrize("name", DRIVES)
def test_neighbours_change_nothing(name: str) -> None:
    """A recording gives bit for bit the same beside others, longer or broken ones, as alone."""
    case = Case(DRIVES[name]())
    sweep = Sweep(case.model, case.active)
    requests = [case.request(np.random.default_rng(seed), width=0.0) for seed in range(3)]
    requests.append(replace(requests[0], x0=np.full_like(requests[0].x0, np.nan)))
    requests.append(long_request(case, 5, scored=False))
    together = sweep.run_many(requests)
    for request, beside in zip(requests, together, strict=True):
        alone = sweep.run_many([request])[0]
        for key, value in arrays(alone).items():
            assert np.array_equal(value, arrays(beside)[key], equal_nan=True), key


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("compiled", [False, True])
def test_carried_states_go_on(name: str, compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Segments simulated one by one, each from where the one before left the carried states, give the same."""
    if not compiled:
        monkeypatch.setenv("CC", "none")
    case = Case(DRIVES[name]())
    sweep, request = Sweep(case.model, ()), case.request(np.random.default_rng(6), width=0.0, derivatives=False)
    carried = np.arange(len(case.model.state_names))[::2]
    found = sweep.run_many([replace(request, carried=carried)])[0]
    x0 = request.x0.copy()
    for segment in range(3):
        alone = sweep.run_many([replace(request, x0=x0)])[0]
        x0[segment + 1 : segment + 2, carried] = alone.end[segment, carried]
    wanted = sweep.run_many([replace(request, x0=x0)])[0]
    for key, value in arrays(wanted).items():
        np.testing.assert_allclose(arrays(found)[key], value, rtol=1e-9, atol=1e-9, err_msg=key)

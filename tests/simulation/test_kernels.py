"""Native code and CasADi's virtual machine give the same answers; the cache of compiled code survives damage."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path
from threading import current_thread, main_thread
from time import sleep

import numpy as np
import pytest
from sweep_cases import DRIVES, Case

from friction_ocp.simulation.compiled import CompiledKernel, compiler, load_library
from friction_ocp.simulation.interpreted import InterpretedKernel
from friction_ocp.simulation.kernel import Piece, SweepResult, empty_result
from friction_ocp.simulation.sweep import Sweep

ROUNDING = 1e-10
"""Order of summation and the last step of Newton's method, carried along a segment."""

SOURCE = "int answer(void) { return 42; }"

needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")


def assert_same(one: SweepResult, other: SweepResult) -> None:
    """Compare all arrays of two results, relative to their largest entries."""
    for name in ("y", "end", "dy", "dend", "states"):
        a, b = getattr(one, name), getattr(other, name)
        assert (a is None) == (b is None)
        if a is not None and a.size:
            np.testing.assert_allclose(a, b, rtol=0, atol=ROUNDING * np.max(np.abs(a)), err_msg=name)


@needs_compiler
@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("width", [0.0, 0.2])
def test_compiled_equals_interpreted(name: str, width: float) -> None:
    """Both kernels fill the same arrays, with and without derivatives, smoothed and exact."""
    case = Case(DRIVES[name]())
    sweep = Sweep(case.model, case.active)
    assert isinstance(sweep.kernel, CompiledKernel)
    interpreted = InterpretedKernel(case.model, case.active)
    for derivatives in (False, True):
        request = case.request(np.random.default_rng(4), width, derivatives)
        into = empty_result(request, len(case.model.state_names), len(case.model.output_names), len(case.active))
        interpreted.run([Piece(request, into)])
        assert_same(sweep.run_many([request])[0], into)


def test_without_compiler_the_sweep_is_interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    """CC=none selects CasADi's virtual machine, and the front works the same."""
    monkeypatch.setenv("CC", "none")
    case = Case(DRIVES["one mass"]())
    sweep = Sweep(case.model, case.active)
    assert isinstance(sweep.kernel, InterpretedKernel)
    request = case.request(np.random.default_rng(5))
    result = sweep.run(request.grid, request.first, request.x0, request.p, request.width)
    assert np.all(np.isfinite(result.y)) and np.all(np.isfinite(result.end))


@needs_compiler
def test_threads_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Recordings and segments simulated side by side give bit for bit what one thread gives."""
    case = Case(DRIVES["two masses"]())
    sweep = Sweep(case.model, case.active)
    requests = [case.request(np.random.default_rng(seed)) for seed in range(2)]
    fine = [replace(item, grid=replace(item.grid, substeps=item.grid.substeps * 40)) for item in requests]
    results: list[list[SweepResult]] = []
    for threads in ("1", "3"):
        monkeypatch.setenv("FRICTION_OCP_THREADS", threads)
        results.append(sweep.run_many(fine))
    for one, three in zip(*results, strict=True):
        for name in ("y", "end", "dy", "dend", "states"):
            assert np.array_equal(getattr(one, name), getattr(three, name))


@needs_compiler
def test_interrupted_threads_are_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupts, one or more, come out when no thread is left that writes to memory that is given back then."""
    case = Case(DRIVES["two masses"]())
    kernel = Sweep(case.model, case.active).kernel
    requests = [case.request(np.random.default_rng(seed)) for seed in range(2)]
    fine = [replace(item, grid=replace(item.grid, substeps=item.grid.substeps * 40)) for item in requests]
    sizes = len(case.model.state_names), len(case.model.output_names), len(case.active)
    begun, ended = list[object](), list[object]()

    def slow(self: CompiledKernel, work: object) -> None:
        if current_thread() is main_thread():
            return  # what it simulates ends before it is interrupted
        begun.append(work)
        sleep(0.1)  # until all threads run
        os.kill(os.getpid(), signal.SIGINT)
        sleep(0.1)
        ended.append(work)

    monkeypatch.setattr(CompiledKernel, "_simulate", slow)
    with pytest.raises(KeyboardInterrupt):
        kernel.run([Piece(item, empty_result(item, *sizes)) for item in fine], threads=2)
    assert len(begun) == len(ended) == 2


@needs_compiler
@pytest.mark.parametrize("damage", [b"", b"not a library", None])
def test_damaged_cache_is_rebuilt(tmp_path: Path, damage: bytes | None) -> None:
    """A cached library that is empty, foreign or cut short is built anew."""
    program = compiler()
    assert program is not None
    load_library(SOURCE, program, tmp_path)
    (cached,) = tmp_path.glob("*.so")
    sound = cached.read_bytes()
    cached.unlink()
    cached.write_bytes(sound[: len(sound) // 2] if damage is None else damage)
    assert load_library(SOURCE, program, tmp_path).answer() == 42
    assert len(cached.read_bytes()) == len(sound)


@needs_compiler
def test_unwritable_cache_is_no_obstacle(tmp_path: Path) -> None:
    """Where the cache folder cannot be made, the code is built for this process alone."""
    program = compiler()
    assert program is not None
    (tmp_path / "file").write_text("in the way")
    assert load_library(SOURCE, program, tmp_path / "file" / "cache").answer() == 42
    assert list(tmp_path.iterdir()) == [tmp_path / "file"]

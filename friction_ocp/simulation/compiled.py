"""Native code for the maps of a drive: written from CasADi's functions, looped in C (sweep.c), cached by content.

An accelerator, never a requirement: `compile_sweep` returns None where no C compiler works.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import cache, lru_cache
from importlib.resources import files
from itertools import pairwise
from pathlib import Path

from friction_ocp.drive.stepping import SteppedDrive
from friction_ocp.simulation.chained import chained
from friction_ocp.simulation.kernel import AbstractKernel, Piece
from friction_ocp.simulation.lane_code import chain_code, lane_code
from friction_ocp.simulation.maps import SweepMap, delay_indices, sweep_maps
from friction_ocp.simulation.parts import parts_of
from friction_ocp.simulation.plan import AsItIs
from friction_ocp.simulation.segment_table import Addresses, alike, segment_table, shares

FLAGS = (
    *("-O3", "-freciprocal-math", "-fno-signed-zeros", "-fno-trapping-math", "-fno-math-errno", "-fwrapv"),
    *("-fPIC", "-shared"),
)
"""The same numbers on every processor. Reciprocals take the place of repeated divisions; sums stay in the order of the
model: with `-fassociative-math` the values beside derivatives are no longer those without."""
QUICK_FLAGS = ("-O2", *FLAGS[1:])
"""For code that runs a few times only, such as the values of a candidate: sooner compiled."""
STEPS_WORTH_A_THREAD = 1500
"""Integrator steps below which handing work to another thread costs more than it saves."""


class CompiledKernel(AbstractKernel):
    """Calls the compiled loop; ctypes lets other threads run meanwhile."""

    keeps_course = True

    def __init__(self, library: ctypes.CDLL) -> None:
        self._sweep = library.friction_ocp_sweep
        self._sweep.restype = None
        self._lanes = int(library.friction_ocp_lanes())

    def run(self, pieces: Sequence[Piece], threads: int = 1) -> None:
        plans = [chained(piece) or parts_of(piece) or AsItIs(piece) for piece in pieces]
        self._run([first for plan in plans if (first := plan.ahead()) is not None], threads)
        works = [plan.work() for plan in plans]
        self._run(works, threads)
        for plan, work in zip(plans, works, strict=True):
            plan.finish(work.into)

    def _run(self, pieces: Sequence[Piece], threads: int) -> None:
        for group in alike(pieces):
            table, columns = segment_table(group), group[0].columns
            order = table.order()
            steps, rows = table.steps[order], table.rows[order]
            count = max(1, min(threads, int(steps.sum()) // STEPS_WORTH_A_THREAD))
            cuts = shares(steps, self._lanes, count)
            works = [(rows[begin:stop], columns) for begin, stop in pairwise(cuts) if stop > begin]
            if len(works) > 1:
                self._simulate_all(works, threads)
            else:
                self._simulate(works[0])

    def _simulate_all(self, works: Sequence[tuple[Addresses, int]], threads: int) -> None:
        pool = _pool(threads)
        running = [pool.submit(self._simulate, work) for work in works]
        _await(running)
        for item in running:
            item.result()

    def _simulate(self, work: tuple[Addresses, int]) -> None:
        rows, columns = work
        self._sweep(ctypes.c_long(len(rows)), ctypes.c_void_p(rows.ctypes.data), ctypes.c_int(columns))


def _await(running: Sequence[Future[None]]) -> None:
    """Wait for threads; an interrupt is raised when none of them writes any longer to memory that is given back then.

    However often that is asked for: it takes a sweep at most.
    """
    interrupt: KeyboardInterrupt | None = None
    while True:
        try:
            wait(running)
            break
        except KeyboardInterrupt as error:
            interrupt = error
            for item in running:
                item.cancel()
    if interrupt is not None:
        raise interrupt


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="sweep")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)


def compiler() -> str | None:
    """Return the C compiler to use: CC, else cc or gcc or clang; None where there is none or CC is `none`."""
    chosen = os.environ.get("CC", "")
    if chosen == "none":
        return None
    return next(
        (path for path in (shutil.which(name) for name in (chosen, "cc", "gcc", "clang") if name) if path), None
    )


@cache
def vector_flags() -> tuple[str, ...]:
    """Return how many segments to simulate side by side, and what the processor needs to be told for it.

    The numbers are the same either way: no multiplication is fused with an addition.
    """
    try:
        flags = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        flags = ""
    return ("-DLANES=4", "-mavx2") if " avx2 " in flags else ("-DLANES=2",)


def stated_flags() -> tuple[str, ...]:
    """Return what FRICTION_OCP_CFLAGS adds, such as -O1: compiled sooner, simulated slower, the same numbers."""
    return tuple(os.environ.get("FRICTION_OCP_CFLAGS", "").split())


def cache_folder() -> Path:
    """Return the folder of compiled code, below XDG_CACHE_HOME or ~/.cache."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "friction-ocp"


def compile_sweep(drive: SteppedDrive, active: Sequence[int], values_only: bool = False) -> CompiledKernel | None:
    """Return the compiled loop of a drive, built or from the cache; None where that fails.

    Code for `values_only` is compiled several times faster and gives no derivatives.
    """
    program = compiler()
    if program is None:
        return None
    flags = (*(QUICK_FLAGS if values_only else FLAGS), *vector_flags(), *stated_flags())
    try:
        return CompiledKernel(_library(generated_source(drive, active, values_only), program, cache_folder(), flags))
    except (OSError, RuntimeError, subprocess.SubprocessError):
        return None


@lru_cache(maxsize=64)
def _library(source: str, program: str, folder: Path, flags: tuple[str, ...]) -> ctypes.CDLL:
    return load_library(source, program, folder, flags)


def load_library(source: str, program: str, folder: Path, flags: tuple[str, ...] = FLAGS) -> ctypes.CDLL:
    """Load compiled code from a cache folder; build it where it is missing or damaged.

    Where the folder cannot be written the code is built in a temporary folder, for this process alone. Raises
    OSError or SubprocessError where it cannot be built.
    """
    key = hashlib.sha256("\n".join((source, program, *flags, platform.platform())).encode()).hexdigest()[:24]
    cached = folder / f"{key}.so"
    if _is_intact(cached):
        return ctypes.CDLL(str(cached))
    with tempfile.TemporaryDirectory() as scratch:
        code, library = Path(scratch) / "sweep.c", Path(scratch) / f"{key}.so"
        code.write_text(source)
        subprocess.run([program, *flags, "-o", str(library), str(code), "-lm"], check=True, capture_output=True)
        return ctypes.CDLL(str(_kept(library, cached)))


def _is_intact(library: Path) -> bool:
    """Whether a cached library carries the digest of its content: loading a damaged one can kill the process."""
    try:
        content = library.read_bytes()
    except OSError:
        return False
    size = hashlib.sha256().digest_size
    return hashlib.sha256(content[:-size]).digest() == content[-size:]


def _kept(library: Path, cached: Path) -> Path:
    """Put a library and its digest into the cache in one go; return where it can be loaded from."""
    content = library.read_bytes()
    staged = cached.with_name(f"{cached.stem}.{os.getpid()}.tmp")
    try:
        cached.parent.mkdir(parents=True, exist_ok=True)
        staged.write_bytes(content + hashlib.sha256(content).digest())
        staged.replace(cached)
    except OSError:
        return library
    return cached


def generated_source(drive: SteppedDrive, active: Sequence[int], values_only: bool = False) -> str:
    """Return the C code of a drive: its maps, their sizes and table, and the loop."""
    maps = sweep_maps(drive, active)
    values = {short: item.value_functions() for short, item in maps.items()}
    slopes = {} if values_only else {item.name: item.derivative(active) for item in maps.values()}
    functions = [function for stages in values.values() for function in stages]
    sizes = {
        "NX": len(drive.state_names),
        "NU": len(drive.input_names),
        "NP": len(drive.parameter_names),
        "NW": drive.step.size1_in(4),
        "NA": len(active),
        "NY": len(drive.output_names),
        "NL": max(item.unknowns for item in maps.values()),
        "NK": max(stages[0].size1_out(0) for stages in values.values()),
    }
    defines = "".join(f"#define {name} {size}\n" for name, size in sizes.items()) + "#define NC (NX + NA)\n"
    code = [lane_code(function) for function in (*functions, *slopes.values())]
    code += [chain_code(name, slope) for name, slope in slopes.items()]
    table = _table(maps, delay_indices(drive), values_only)
    return "\n".join((lane_headers(), defines, *code, MAP, table, _c_code("sweep.c")))


def lane_headers() -> str:
    """Return the C code that all code of `lane_code` needs."""
    return _c_code("lanes.h") + _c_code("lane_math.h")


def _c_code(name: str) -> str:
    return files("friction_ocp.simulation").joinpath(name).read_text(encoding="utf-8")


MAP = """typedef void (*function)(const lanes *const *, lanes *const *, int);
typedef void (*chain_rule)(const lanes *, const lanes *, const lanes *, lanes *, int);
typedef struct {
  int unknowns;
  function constants, newton, value, derivative;
  chain_rule chain;
} map;
"""


def _table(maps: Mapping[str, SweepMap], delays: Sequence[int], values_only: bool) -> str:
    lines = [f"static const int DELAYS[] = {{{', '.join(map(str, delays))}}};"] if "now" in maps else []
    for short, item in maps.items():
        stages = f"{item.name}_c, {item.name}_n" if item.unknowns else "0, 0"
        slopes = "0, 0" if values_only else f"{item.name}_d, {item.name}_s"
        entry = f"{{{item.unknowns}, {stages}, {item.name}, {slopes}}}"
        lines += [f"#define {short.upper()} map_{short}", f"static const map map_{short} = {entry};"]
    return "\n".join(lines)

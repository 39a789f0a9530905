"""A file of another program: what every import format says about what it holds, and how it is read."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.optional_library import optional_library
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.recording import FloatArray

Values = npt.NDArray[Any]

MAX_SAMPLES = 50_000_000
"""Samples of one signal: at 10 kHz an hour and a half. More is refused before it is read."""
COPIES = 4
"""How many times a signal is in memory while it is read, converted and written."""

EXACT_INTEGERS = 2**53
"""Integers up to here are floats without loss; time in ns since 1970 is beyond it, and as many ns are 104 days."""


@dataclass(frozen=True)
class Signal:
    """One series of values as the file lists it."""

    name: str
    samples: int
    unit: str = ""
    """As the file states it; "" where it states none."""
    clock: str = ""
    """The time axis that the file itself gives it; "" where it gives none."""
    numeric: bool = True
    text: str = ""
    """What it says, where it is one text, such as the name of what stands beside it."""


@dataclass(frozen=True)
class ForeignFile:
    """Signals of one open file, read only where they are wanted."""

    signals: tuple[Signal, ...]
    read: Callable[[Sequence[int]], Mapping[int, Values]]
    """Indices of signals -> (n,) real numbers each, NaN where one is missing."""
    clock: Callable[[str], FloatArray]
    """Name of a time axis -> (n,) s; all axes of a file count from one instant."""
    summary: str = ""
    """What kind of file it is, for `--inspect`."""
    origin: str = ""
    """The instant from which its time axes count, where that is known."""


Opener = Callable[[Path, ImportMap | None], AbstractContextManager[ForeignFile]]
"""Opens a file of one format; the map may say how it is written."""


def no_clock(name: str) -> FloatArray:
    """Stand in for the time axes of a format that has none."""
    raise KeyError(name)


@dataclass(frozen=True)
class Library:
    """A library of others that reads a format."""

    module: str
    package: str
    extra: str
    """Of this package, that installs it."""

    def load(self, path: Path) -> Any:
        """Import it to read a file; raises FrictionOcpError with the install command where it is missing."""
        purpose = f"reading {path.suffix or 'this folder'}"
        return optional_library(self.module, self.package, self.extra, str(path), purpose)


@contextmanager
def reading(path: Path, kind: str) -> Generator[None]:
    """Turn whatever a library raises about a file into a finding."""
    try:
        yield
    except FrictionOcpError:
        raise
    except Exception as error:  # what hostile files provoke in readers of others is not to be foreseen
        raise damaged(path, kind, error) from error


def damaged(path: Path, kind: str, error: Exception) -> FrictionOcpError:
    """Return the finding about a file that its library cannot read."""
    what = f"this cannot be read as {kind} ({reason_of(error)})"
    return FrictionOcpError(Finding(str(path), what, remedy="the file may be damaged; copy it again"))


def reason_of(error: Exception) -> str:
    """Return what a library says of its error, on one line; the kind of it where it says nothing."""
    return " ".join(str(error).split())[:200] or type(error).__name__


@contextmanager
def opened(path: Path, kind: str, make: Callable[[], Any]) -> Generator[Any]:
    """Open a file by its library, and close it at the end.

    Libraries that fail halfway complain again when their remains are collected: that happens here, unheard.
    """
    complain, sys.unraisablehook = sys.unraisablehook, _unheard
    try:
        file, fault = _attempt(path, kind, make)
        if fault is not None:
            gc.collect()
    finally:
        sys.unraisablehook = complain
    if fault is not None:
        raise fault
    with reading(path, kind), file as inside:
        yield inside


def _unheard(unraisable: object) -> None:
    """Stand in for the hook that prints what goes wrong while objects are collected."""


def _attempt(path: Path, kind: str, make: Callable[[], Any]) -> tuple[Any, FrictionOcpError | None]:
    try:
        return make(), None
    except Exception as error:  # as in `reading`
        return None, damaged(path, kind, error)


def check_sizes(path: Path, signals: Sequence[Signal]) -> None:
    """Refuse signals that are too long or do not fit into the free memory, before anything is read."""
    where = str(path)
    long = [signal for signal in signals if signal.samples > MAX_SAMPLES]
    allowed, remedy = f"at most {MAX_SAMPLES}", "split or thin the file"
    if long:
        raise FrictionOcpError(
            [Finding(where, f"'{item.name}' declares {item.samples} samples", allowed, remedy) for item in long]
        )
    needed, free = COPIES * 8 * sum(signal.samples for signal in signals), free_memory()
    if needed > free:
        what = f"about {needed / 1e9:.3g} GB of memory are needed, {free / 1e9:.3g} GB are free"
        raise FrictionOcpError(Finding(where, what, remedy="import fewer channels, or " + remedy))


def refuse_large(path: Path, size: int, what: str) -> None:
    """Refuse a file that unpacks to `size` bytes where that does not fit, before anything is unpacked."""
    limit = min(8 * MAX_SAMPLES * 8, free_memory() // 2)
    if size > limit:
        declared = f"its {what} declare {size} bytes"
        raise FrictionOcpError(Finding(str(path), declared, f"at most {limit}", f"save fewer {what} in one file"))


def free_memory() -> int:
    """Return the free memory in bytes, as far as the system tells."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration, ValueError):
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 2**34


def is_real(values: Values) -> bool:
    """Whether an array holds real numbers: truth values, integers or floats."""
    return values.dtype.kind in "biuf"


def seconds_since(nanoseconds: Values, origin: int) -> FloatArray:
    """Return s since an origin; the difference is taken in integers, so that no digit of a date is lost."""
    return np.asarray((nanoseconds.astype(np.int64) - np.int64(origin)) * 1e-9, dtype=np.float64)


def instant(nanoseconds: int) -> str:
    """Return a count of ns since 1970 as a date, UTC; "" for 0, which stands for a file without dates."""
    return f"{np.datetime64(nanoseconds, 'ns')}Z" if nanoseconds else ""

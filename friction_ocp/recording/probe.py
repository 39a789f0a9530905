"""Files are read in a child process first: damage that hangs or kills a library of others takes the child alone.

The child is a fork, limited in processor time and memory. What it reads is thrown away, with the temporary files that
libraries leave behind when they fail; where it refuses a file that is the answer, for a library that read damage once
may not survive it twice. Where there is no fork (Windows) files are read without it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import faulthandler
import functools
import json
import os
import signal
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Concatenate, ParamSpec, TypeVar

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.foreign import free_memory

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

SECONDS, BYTES_PER_SECOND = 6, 500_000
"""Processor time of a small file, in which what is not loaded yet is loaded, and how much more a larger one gets."""
_SOUND, _REFUSED, _TOO_LARGE = 0, 1, 2


def probed(
    read: Callable[Concatenate[str | Path, Arguments], Result],
) -> Callable[Concatenate[str | Path, Arguments], Result]:
    """Make a reader of files one that survives what they do to the libraries that it uses."""

    @functools.wraps(read)
    def guarded(path: str | Path, *args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        known = _identity(read, Path(path))
        if hasattr(os, "fork") and not _probing and (known is None or known not in _survived):
            with tempfile.TemporaryDirectory() as scratch:
                _probe(Path(path), lambda: read(path, *args, **kwargs), scratch)
            if known is not None:
                _survived.add(known)
        return read(path, *args, **kwargs)

    return guarded


_probing: list[bool] = []
"""Not empty in a child: what a reader calls there is not probed again."""
_survived: set[tuple[object, ...]] = set()
"""Files that were read without harm, as they were then."""


def _identity(read: Callable[..., object], path: Path) -> tuple[object, ...] | None:
    """Return what tells whether a file is still the same; None for what is no file."""
    try:
        facts = path.stat()
    except OSError:
        return None
    return (read, path.absolute(), facts.st_ino, facts.st_size, facts.st_mtime_ns) if path.is_file() else None


def _size(path: Path) -> int:
    """Return the bytes of a file, or of all files in a folder."""
    if path.is_dir():
        return sum(_size(item) for item in path.iterdir() if item.is_file())
    return path.stat().st_size if path.is_file() else 0


def _probe(path: Path, read: Callable[[], object], scratch: str) -> None:
    """Read in a child whose temporary files go to `scratch`; raises FrictionOcpError if it did not come back."""
    seconds = SECONDS + _size(path) // BYTES_PER_SECOND
    receiving, sending = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of forks beside threads: the child only reads a file
        child = os.fork()
    if child == 0:
        os.close(receiving)
        tempfile.tempdir = scratch
        _read_and_leave(read, seconds, sending)
    os.close(sending)
    try:
        with os.fdopen(receiving, "r", encoding="utf-8") as pipe:
            refusal = pipe.read()
        _, status = os.waitpid(child, 0)
    except BaseException:
        with contextlib.suppress(OSError):
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
        raise
    remedy = "the file may be damaged; copy it again"
    if os.WIFSIGNALED(status):
        late = os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL)
        ended = f"has no end within {seconds} s" if late else f"ends with signal {os.WTERMSIG(status)}"
        raise FrictionOcpError(Finding(str(path), f"reading it {ended}", remedy=remedy))
    if os.WEXITSTATUS(status) == _TOO_LARGE:
        what = f"reading it takes more memory than the {free_memory() / 1e9:.3g} GB that are free"
        raise FrictionOcpError(Finding(str(path), what, remedy="split the file, or " + remedy))
    if refusal:
        raise FrictionOcpError([Finding(**item) for item in json.loads(refusal)])


def _read_and_leave(read: Callable[[], object], seconds: int, sending: int) -> None:
    """Read and end the process, whatever happens, without a word but why the file is refused."""
    status = _REFUSED
    try:
        _probing.append(True)
        faulthandler.disable()
        _limit(seconds)
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        read()
        status = _SOUND
    except FrictionOcpError as error:
        status = _TOO_LARGE if isinstance(error.__cause__, MemoryError) else _REFUSED
        with os.fdopen(sending, "w", encoding="utf-8") as pipe:
            json.dump([dataclasses.asdict(finding) for finding in error.findings], pipe)
    except MemoryError:
        status = _TOO_LARGE
    except BaseException:
        status = _REFUSED
    finally:
        os._exit(status)


def _limit(seconds: int) -> None:
    """Limit processor time and memory of this process, as far as the system can."""
    import resource

    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform.startswith("linux"):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        most = pages * os.sysconf("SC_PAGE_SIZE") + free_memory()
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        if hard == resource.RLIM_INFINITY and soft == resource.RLIM_INFINITY:
            resource.setrlimit(resource.RLIMIT_AS, (most, most))

"""What holds for all tests: this folder is importable, examples are the same in every run, signals stay as they are."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import settings

settings.register_profile("steady", deadline=None, derandomize=True)
settings.load_profile("steady")

os.environ.setdefault("FRICTION_OCP_CFLAGS", "-O1")
"""Short runs wait for the compiler more than for what it makes faster."""


@pytest.fixture(scope="module")
def without_figures() -> Iterator[None]:
    """Leave out figures/ for a module that makes many results and looks at other parts of them: it is most of a fit."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("friction_ocp.plots.figures.write_figures", lambda *_: [])
        yield


@pytest.fixture(autouse=True)
def _signals_as_they_were() -> Iterator[None]:
    """Undo the handlers that the command line installs; Ctrl-C works even where the shell had switched it off."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)

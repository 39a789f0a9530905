"""A library that is missing is told; one whose loading was interrupted is not missing."""

from __future__ import annotations

import importlib

import pytest

from friction_ocp.errors import FrictionOcpError
from friction_ocp.optional_library import optional_library


@pytest.mark.parametrize(("cause", "expected"), [(KeyboardInterrupt(), KeyboardInterrupt), (None, FrictionOcpError)])
def test_an_interrupt_is_no_missing_library(
    cause: BaseException | None, expected: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    """An extension that is stopped while it loads another one fails as if that were not there."""

    def load(name: str) -> None:
        raise ImportError(name) from cause

    monkeypatch.setattr(importlib, "import_module", load)
    with pytest.raises(expected):
        optional_library("mujoco", "mujoco", "mujoco", "export", "measuring what it costs")

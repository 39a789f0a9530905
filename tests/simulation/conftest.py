"""Compiled simulations are tested as they are shipped: with all that the compiler can do."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _as_shipped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FRICTION_OCP_CFLAGS", raising=False)

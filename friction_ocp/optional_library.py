"""Libraries that only some installations have."""

from __future__ import annotations

import importlib
from typing import Any

from friction_ocp.errors import Finding, FrictionOcpError


def optional_library(module: str, package: str, extra: str, where: str, purpose: str) -> Any:
    """Import a library; raises FrictionOcpError with the install command of its extra where it is missing."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        if _was_interrupted(error):
            raise KeyboardInterrupt from error
        what = f"{purpose} needs the package {package}, which is not installed"
        raise FrictionOcpError(Finding(where, what, remedy=f"pip install 'friction-ocp[{extra}]'")) from error


def _was_interrupted(error: BaseException | None) -> bool:
    """Whether an interrupt lies below an error: extensions that load others turn it into an ImportError."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None

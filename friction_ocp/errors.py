"""Findings about bad input, and the error that carries all of them at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong or doubtful, in the order in which a person needs it."""

    where: str
    """File and path inside it, or the part of the drive."""
    what: str
    """What is wrong, with value and unit."""
    allowed: str = ""
    """What would be accepted."""
    remedy: str = ""
    """What to do."""
    severity: Literal["error", "warning"] = "error"

    def __str__(self) -> str:
        tail = "; ".join(part for part in (self.what, self.allowed, self.remedy) if part)
        return f"{self.where}: {tail}"


class FrictionOcpError(Exception):
    """Input that cannot be used; `findings` holds every reason, not only the first."""

    def __init__(self, findings: Finding | Sequence[Finding]) -> None:
        self.findings = (findings,) if isinstance(findings, Finding) else tuple(findings)
        super().__init__("\n".join(str(finding) for finding in self.findings))

"""How a piece is simulated: as it is, or by way of another that takes less time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from friction_ocp.simulation.kernel import Piece, SweepResult


@dataclass(frozen=True)
class AbstractPlan(ABC):
    """What to simulate for a piece, in turn."""

    piece: Piece

    @abstractmethod
    def ahead(self) -> Piece | None:
        """Return what has to be known first; None where that is nothing."""

    @abstractmethod
    def work(self) -> Piece:
        """Return what to simulate once that is known."""

    @abstractmethod
    def finish(self, found: SweepResult) -> None:
        """Write what follows from it into the result of the piece."""


class AsItIs(AbstractPlan):
    """The piece itself."""

    def ahead(self) -> None:
        return None

    def work(self) -> Piece:
        return self.piece

    def finish(self, found: SweepResult) -> None:
        pass

"""Interrupts that wait for the end of a step."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from friction_ocp.estimation.progress import Progress, Report


class Patience:
    """Lets the first interrupt wait for the end of a step; a second one stops at once.

    An exception raised while CasADi calls back into Python would be lost or come out as another one.
    """

    def __init__(self) -> None:
        self.asked = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._ask)

    def _ask(self, number: int, frame: object) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    def watching(self, progress: Progress) -> Progress:
        """Return `progress` that stops the fit after a step if that was asked for."""

        def update(report: Report) -> None:
            progress(report)
            if self.asked:
                raise KeyboardInterrupt

        return update

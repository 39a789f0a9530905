"""A polyline whose jump at standstill is a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from friction_ocp.friction.maxwell import AbstractMaxwellSlip, Spring
from friction_ocp.friction.static import Polyline
from friction_ocp.parameters import Value, quantity


@dataclass(frozen=True)
class PolylineHysteresis(AbstractMaxwellSlip):
    """A polyline whose dry part turns from one direction to the other over the travel `width`, as one Maxwell spring.

    At reversal the torque follows a line over the travel, so that torque over speed is a loop.

    Source: Leighton telescope paper, Fig. 6c (Fig. 6b, `omega_zero` of the plain polyline, leaves the loop out).
    """

    polyline: Polyline
    width: Value = quantity("angle", "travel over which the dry friction reverses")
    name: ClassVar[str] = "polyline_hysteresis"

    def springs(self, level: Any) -> tuple[Spring, ...]:
        return (Spring(2.0 * level / self.width, 0.5 * self.width),)

    def level(self, speed: Any) -> Any:
        return self.polyline.tau_c + 0.0 * speed

    def drag(self, speed: Any) -> Any:
        return self.polyline.line(speed) - self.polyline.tau_c

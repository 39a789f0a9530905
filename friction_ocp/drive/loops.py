"""The loop in the twist of a transmission: a bristle and springs that slip, between two shafts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from friction_ocp.drive.parts import Hysteresis
from friction_ocp.friction.maxwell import Play
from friction_ocp.friction.smoothing import decay_means, smooth_abs


@dataclass(frozen=True)
class Loop:
    """A loop with its deflections, the bristle's first."""

    hysteresis: Hysteresis
    deflections: tuple[Any, ...]

    @property
    def _plays(self) -> list[Play]:
        springs = self.hysteresis.springs
        return [] if springs is None else [Play(item, item) for item in springs.under(self.hysteresis.torque)]

    @property
    def _stiffness(self) -> Any:
        """Stiffness of the bristle."""
        springs, whole = self.hysteresis.springs, self.hysteresis.torque / self.hysteresis.twist
        return whole if springs is None else whole * springs.rest

    def _forgetting(self, rate: Any) -> Any:
        """Return the rate at which the bristle forgets its deflection while the twist changes at `rate`."""
        return smooth_abs(rate) / self.hysteresis.twist

    def rates(self, rate: Any) -> list[Any]:
        """Return the time derivatives of the deflections while the twist changes at `rate`."""
        z, *others = self.deflections
        slipping = [item.torque_and_rate(rate, one)[1] for item, one in zip(self._plays, others, strict=True)]
        return [rate - self._forgetting(rate) * z, *slipping]

    def torque(self) -> Any:
        """Return the torque at an instant."""
        z, *others = self.deflections
        held = [item.elastic(one) for item, one in zip(self._plays, others, strict=True)]
        return sum(held, self._stiffness * z)

    def mean_torque(self, rate: Any, steady: Any, h: Any) -> Any:
        """Return the mean torque over a step of `h` s at constant `rate`; what forgets does so at the rate `steady`."""
        z, *others = self.deflections
        kept, added = decay_means(h * self._forgetting(steady))
        held = [item.mean_torque(one, h * rate) for item, one in zip(self._plays, others, strict=True)]
        return sum(held, self._stiffness * (kept * z + h * added * rate))

    def after(self, rate: Any, h: Any) -> list[Any]:
        """Return the deflections after a step of `h` s at constant `rate`."""
        z, *others = self.deflections
        kept, _ = decay_means(h * self._forgetting(rate))
        slipped = [item.after(one, h * rate) for item, one in zip(self._plays, others, strict=True)]
        return [z + h * kept * (rate - self._forgetting(rate) * z), *slipped]

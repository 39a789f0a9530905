"""What changes the friction of a shaft beside its speed and its load: angle, time and temperature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from friction_ocp.friction.smoothing import expm1
from friction_ocp.friction.wave import Wave
from friction_ocp.parameters import Value, is_off, quantity


@dataclass(frozen=True)
class Surroundings:
    """What friction may depend on beside speed and load."""

    theta: Any = 0.0
    """Angle of the shaft."""
    passed: Any = None
    """Angle passed in the step over which friction is averaged; None at an instant."""
    time: Any = 0.0
    """s since the start of the recording."""
    temperature: Any = 0.0
    """degC."""
    warmth: Any = None
    """How far friction has settled where its own losses warm it; None where time alone says."""


@dataclass(frozen=True)
class Ripple(
    Wave,
    kind="dimensionless",
    of="the relative change of dry friction over the angle",
    over="angle",
    period="the friction over the angle",
):
    """Dry friction times 1 + a wave over the shaft's own angle."""


@dataclass(frozen=True)
class WarmUp:
    r"""All friction times 1 + per_kelvin (T - reference_temperature) + amplitude W.

    .. math:: \text{time\_constant} \, \dot W = 1 - \text{loss\_share} + \text{loss\_share} \, P / \text{power} - W

    T is the measured temperature and P the power that the friction itself loses at steady speed; W is `begun` at the
    start of the recording, and 1 - (1 - begun) exp(-t / time_constant) without the losses. `viscous_excess` is added to
    the amplitude where viscous friction is meant.
    """

    per_kelvin: Value = quantity("per_kelvin", "relative change of friction with the temperature", 0.0)
    amplitude: Value = quantity("dimensionless", "relative change of friction in the long run", 0.0)
    time_constant: Value = quantity("time", "time in which friction settles", None, nested="guess")
    reference_temperature: Value = quantity("temperature", "temperature at which friction has its values", 20.0)
    viscous_excess: Value = quantity("dimensionless", "relative change of viscous friction beyond that of all", None)
    loss_share: Value = quantity("dimensionless", "share of the warming that goes with the friction's own losses", 0.0)
    power: Value = quantity("power", "loss at which friction settles at the amplitude", None)
    begun: Value = quantity("dimensionless", "how far friction has settled where a recording begins", None)

    @property
    def idle(self) -> bool:
        """Whether nothing changes with temperature or time."""
        return is_off(self.per_kelvin) and is_off(self.amplitude)

    @property
    def by_losses(self) -> bool:
        """Whether the losses of friction warm it, once plain zeros are left out."""
        return self.amplitude is not None and self.loss_share is not None

    def live(self) -> WarmUp:
        """Return what is left without the terms that are plainly zero; their numbers are None."""
        per_kelvin = None if is_off(self.per_kelvin) else self.per_kelvin
        amplitude = None if is_off(self.amplitude) else self.amplitude
        loss_share = None if amplitude is None or is_off(self.loss_share) else self.loss_share
        return WarmUp(
            per_kelvin,
            amplitude,
            None if amplitude is None else self.time_constant,
            None if per_kelvin is None else self.reference_temperature,
            None if amplitude is None else self.viscous_excess,
            loss_share,
            None if loss_share is None else self.power,
            None if amplitude is None or is_off(self.begun) else self.begun,
        )

    def factors(self, surroundings: Surroundings) -> tuple[Any, Any]:
        """Return the factors on dry and on viscous friction."""
        dry: Any = 1.0
        if self.per_kelvin is not None:
            dry = dry + self.per_kelvin * (surroundings.temperature - self.reference_temperature)
        if self.amplitude is None:
            return dry, dry
        risen = self.risen(surroundings.time) if surroundings.warmth is None else surroundings.warmth
        dry = dry + self.amplitude * risen
        return dry, dry if self.viscous_excess is None else dry + self.viscous_excess * risen

    def risen(self, time: Any) -> Any:
        """Return how far friction has settled after some time under losses as large as `power`, or without any."""
        rise = -expm1(-time / self.time_constant)
        return rise if self.begun is None else self.begun + (1.0 - self.begun) * rise

    def rate(self, warmth: Any, loss: Any) -> Any:
        """Return the time derivative of the warmth under a loss, W."""
        return (self._source(loss) - warmth) / self.time_constant

    def after(self, h: Any, warmth: Any, loss: Any) -> Any:
        """Return the warmth after `h` s under a constant loss, W."""
        return warmth - expm1(-h / self.time_constant) * (self._source(loss) - warmth)

    def _source(self, loss: Any) -> Any:
        return 1.0 + self.loss_share * (loss / self.power - 1.0)

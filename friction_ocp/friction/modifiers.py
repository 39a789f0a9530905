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
    """All friction times 1 + per_kelvin (T - reference_temperature) + amplitude (1 - exp(-t / time_constant)).

    T is the measured temperature, t the time since the start of the recording; `viscous_excess` is added to the
    amplitude where viscous friction is meant.
    """

    per_kelvin: Value = quantity("per_kelvin", "relative change of friction with the temperature", 0.0)
    amplitude: Value = quantity("dimensionless", "relative change of friction in the long run", 0.0)
    time_constant: Value = quantity("time", "time in which friction settles", None, nested="guess")
    reference_temperature: Value = quantity("temperature", "temperature at which friction has its values", 20.0)
    viscous_excess: Value = quantity("dimensionless", "relative change of viscous friction beyond that of all", None)

    @property
    def idle(self) -> bool:
        """Whether nothing changes with temperature or time."""
        return is_off(self.per_kelvin) and is_off(self.amplitude)

    def live(self) -> WarmUp:
        """Return what is left without the terms that are plainly zero; their numbers are None."""
        per_kelvin = None if is_off(self.per_kelvin) else self.per_kelvin
        amplitude = None if is_off(self.amplitude) else self.amplitude
        return WarmUp(
            per_kelvin,
            amplitude,
            None if amplitude is None else self.time_constant,
            None if per_kelvin is None else self.reference_temperature,
            None if amplitude is None else self.viscous_excess,
        )

    def factors(self, surroundings: Surroundings) -> tuple[Any, Any]:
        """Return the factors on dry and on viscous friction."""
        dry: Any = 1.0
        if self.per_kelvin is not None:
            dry = dry + self.per_kelvin * (surroundings.temperature - self.reference_temperature)
        if self.amplitude is None:
            return dry, dry
        risen = -expm1(-surroundings.time / self.time_constant)
        dry = dry + self.amplitude * risen
        return dry, dry if self.viscous_excess is None else dry + self.viscous_excess * risen

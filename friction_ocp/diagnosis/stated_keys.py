"""Which effect a value is by that a problem states and the machine contradicts."""

from __future__ import annotations

from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import drive_leaves
from friction_ocp.effects.effect import Key
from friction_ocp.parameters import Free

_SENSOR = {"gain": "sensor_gain", "offset": "sensor_offset", "delay": "sensor_delay"}


def stated_key(path: str, drive: Drive) -> Key:
    """Return effect and component of a parameter that is not as stated."""
    part, _, rest = path.partition(".")
    if any(item.name == part for item in drive.channels):
        return _SENSOR.get(rest, "parameter_error"), part
    return ("inertia_error" if rest == "inertia" else "parameter_error"), part


def stated_keys(drive: Drive) -> list[Key]:
    """Return effects and components of the values of a drive that are fitted about what is stated for them."""
    stated = (leaf.path for leaf in drive_leaves(drive) if isinstance(leaf.value, Free) and leaf.value.prior_std)
    return list(dict.fromkeys(stated_key(path, drive) for path in stated))

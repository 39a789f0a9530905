"""What to record where the recordings cannot tell candidates apart."""

from __future__ import annotations

from typing import Any

from friction_ocp.diagnosis.diagnose import Diagnosis

_EXCITATION = {
    "stribeck": "speeds from well below to well above the Stribeck speed, slowly and in both directions",
    "polyline_break": "constant speeds on either side of the break, up to the fastest",
    "quadratic_drag": "constant speeds up to the fastest, in both directions",
    "asymmetry": "the same speeds in both directions over the same positions",
    "presliding": "small reversals that do not break away, torque rising and falling below breakaway",
    "load_dependence": "the same speeds under several loads",
    "warm_up": "the same motion cold and warm, with the temperature recorded",
    "backlash": "slow reversals with the load at rest and under load on one flank",
    "compliance": "a sweep through the resonance with both sides measured",
    "unbalance": "more than a turn of travel, slowly, in both directions",
    "constant_torque": "standstill and slow motion in both directions",
    "position_ripple": "slow constant speeds over several periods, in both directions",
    "cogging": "slow constant speeds over a turn of the motor",
    "structural_mode": "a sweep through the frequencies of the structure",
    "sensor_offset": "a rest in a known state with the drive off",
    "sensor_delay": "a fast sweep that separates a delay from compliance",
}
"""Motion that makes an effect visible, by effect."""


def next_experiment(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Return what to record to separate the members of the alias sets; None where there are none."""
    if not diagnosis.alias_sets:
        return None
    rivals = list(dict.fromkeys(key for keys in diagnosis.alias_sets for key in keys))
    wanted = [f"{_EXCITATION[effect]} ({effect} at {place})" for effect, place in rivals if effect in _EXCITATION]
    named = " or ".join(f"{effect} at {place}" for effect, place in rivals)
    return {"text": f"To tell {named} apart, record: {'; '.join(wanted) or 'other speeds, loads and positions'}."}

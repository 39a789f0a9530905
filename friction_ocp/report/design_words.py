"""What a design says in words."""

from __future__ import annotations

from friction_ocp.plots.numbers import percent, significant, unit_text
from friction_ocp.plots.reading import Json, objects, part, rows

UNTOLD = 1e3
"""Fall of a standard error from which a parameter was not known before."""


def design_sentence(result: Json) -> str:
    """Return the answer in one sentence."""
    options = rows(result, "options")
    if not options:
        return "No motion keeps the limits, or none could be simulated: widen the limits."
    best = options[0]
    share = float(best["amplitude"])
    what = f"Record {best['sentence']}" + (f", at {percent(share, 2)} of full size" if share < 0.995 else "")
    rivals = rows(result, "separates")
    if rivals:
        named = " and ".join(f"{str(item['effect']).replace('_', ' ')} at {item['component']}" for item in rivals)
        return f"{what}: it decides between {named} with a probability of {chance(best['power'] or 0.0)}."
    return f"{what}: {_sharpest(result, best)}."


def chance(power: float) -> str:
    """Return a probability as a percentage, never as certainty."""
    return "over 99.9 %" if power > 0.999 else percent(power, 2)


def _sharpest(result: Json, best: Json) -> str:
    """Say which parameter gains most."""
    after, gains = part(best, "std_errors"), dict[str, float]()
    for name, item in objects(result, "parameters").items():
        known = after.get(name)
        if known and item["std_error_before"]:
            gains[name] = float(item["std_error_before"]) / float(known)
    if not gains:
        return "nothing is to be sharpened"
    name = max(gains, key=lambda one: gains[one])
    if gains[name] > UNTOLD:
        unit = unit_text(str(part(part(result, "parameters"), name).get("unit", "")))
        return f"{name}, of which the recordings at hand tell nothing, gets a standard error of " + (
            f"{significant(float(after[name]), 2)} {unit}".rstrip()
        )
    return f"the standard error of {name} falls by a factor of {significant(gains[name], 2)}"


def limits_sentence(result: Json) -> str:
    """Say within which limits, and where they come from."""
    stated = set(rows(result, "limits_stated"))
    units = part(result, "limit_units")
    parts = [
        f"{key} {significant(float(value), 3)} {unit_text(str(units.get(key, '')))} "
        f"({'stated' if key in stated else 'reached in the recordings'})"
        for key, value in part(result, "limits").items()
    ]
    return f"Limits at the first shaft: {', '.join(parts)}."


def design_summary(result: Json) -> str:
    """Return a design in a few lines of plain text."""
    lines = [str(result["title"]), "", design_sentence(result), limits_sentence(result), ""]
    for option in rows(result, "options"):
        power = "" if option["power"] is None else f", power {float(option['power']):.2f}"
        lines.append(f"{option['motion']:<16} worth {float(option['worth'] or 0.0):.4g}{power}")
    return "\n".join(lines)

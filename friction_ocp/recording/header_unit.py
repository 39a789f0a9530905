"""The unit that the name of a column states."""

from __future__ import annotations

import re

from friction_ocp.errors import FrictionOcpError
from friction_ocp.quantities import dimension_of


def header_unit(header: str) -> str:
    """Return the unit in "angle [deg]" or "angle (deg)", "" where there is none."""
    match = re.search(r"[\[(]([^\[\]()]+)[\])]\s*$", header)
    if match is None:
        return ""
    try:
        dimension_of(match[1])
    except FrictionOcpError:
        return ""
    return "" if match[1].strip().isdigit() else match[1].strip()

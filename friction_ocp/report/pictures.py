"""Pictures inside a page: as data URIs, so that the page stays one file."""

from __future__ import annotations

import base64
from pathlib import Path


def embedded_png(path: Path) -> str:
    """Return a PNG file as the source of a picture."""
    return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"


def embedded_svg(text: str) -> str:
    """Return an SVG document as the source of a picture."""
    return f"data:image/svg+xml;base64,{base64.b64encode(text.encode()).decode()}"

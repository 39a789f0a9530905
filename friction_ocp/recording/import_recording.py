"""Import of foreign formats: which reader takes which file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.csv import read_csv
from friction_ocp.recording.import_map import ImportMap, load_import_map
from friction_ocp.recording.recording import Recording

Reader = Callable[[Path, ImportMap], Recording]

READERS: Mapping[str, Reader] = {
    ".csv": read_csv,
    ".tsv": read_csv,
    ".txt": read_csv,
}
"""Reader by the suffix of the file; a further format is a further line."""


def import_recording(path: str | Path, map_path: str | Path) -> Recording:
    """Read a foreign file by a map; raises FrictionOcpError for an unknown format and with all that is wrong."""
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        what = f"no reader for '{path.suffix or path.name}'"
        remedy = "export the data to one of them"
        raise FrictionOcpError(Finding(str(path), what, f"available: {', '.join(READERS)}", remedy))
    return reader(path, load_import_map(map_path))

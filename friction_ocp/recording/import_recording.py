"""Import of foreign formats: which reader takes which file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.csv import inspect_csv, read_csv
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


def inspect_file(path: str | Path) -> str:
    """Return what a foreign file holds, one line a column."""
    path = Path(path)
    if path.suffix.lower() not in READERS:
        what = f"no reader for '{path.suffix or path.name}'"
        raise FrictionOcpError(Finding(str(path), what, f"available: {', '.join(READERS)}"))
    summary = inspect_csv(path)
    rate = "" if summary.rate is None else f", about {summary.rate:.6g} rows a second if the first column is time in s"
    lines = [f"{path}: {summary.rows} rows, delimiter {summary.delimiter!r}{rate}"]
    return "\n".join([*lines, *(str(column) for column in summary.columns)])

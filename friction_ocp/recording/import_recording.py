"""Import of foreign formats: which reader takes which file.

Delimited text is read here alone; what libraries of others read is read in a child process first. These are loaded
before that, once for the child and for here.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording import mdf, parquet, rosbag, spreadsheet, tdms
from friction_ocp.recording.csv import open_csv
from friction_ocp.recording.csv_layout import UTF16_MARKS
from friction_ocp.recording.foreign import ForeignFile, Library, Opener
from friction_ocp.recording.import_map import load_import_map
from friction_ocp.recording.json_log import open_json
from friction_ocp.recording.listing import describe
from friction_ocp.recording.matlab import open_matlab
from friction_ocp.recording.matlab_hdf5 import open_hdf5
from friction_ocp.recording.mdf import open_mdf
from friction_ocp.recording.numpy_arrays import open_numpy
from friction_ocp.recording.parquet import open_parquet
from friction_ocp.recording.probe import probed
from friction_ocp.recording.recording import Recording
from friction_ocp.recording.rosbag import open_rosbag
from friction_ocp.recording.spreadsheet import open_spreadsheet
from friction_ocp.recording.static_points import StaticPoints
from friction_ocp.recording.table import recording_of, static_points_of
from friction_ocp.recording.tdms import open_tdms

READERS: Mapping[str, Opener] = {
    ".csv": open_csv,
    ".tsv": open_csv,
    ".txt": open_csv,
    ".parquet": open_parquet,
    ".mat": open_matlab,
    ".h5": open_hdf5,
    ".hdf5": open_hdf5,
    ".mf4": open_mdf,
    ".mdf": open_mdf,
    ".dat": open_mdf,
    ".mcap": open_rosbag,
    ".db3": open_rosbag,
    ".bag": open_rosbag,
    ".tdms": open_tdms,
    ".json": open_json,
    ".jsonl": open_json,
    ".ndjson": open_json,
    ".npy": open_numpy,
    ".npz": open_numpy,
    ".log": open_csv,
    ".asc": open_csv,
    ".xlsx": open_spreadsheet,
    ".xlsm": open_spreadsheet,
    ".xlsb": open_spreadsheet,
    ".xls": open_spreadsheet,
    ".ods": open_spreadsheet,
}
"""Reader by the suffix of the file; a further format is a further line."""
LIBRARIES: Mapping[Opener, Library] = {
    open_parquet: parquet.LIBRARY,
    open_mdf: mdf.LIBRARY,
    open_rosbag: rosbag.LIBRARY,
    open_tdms: tdms.LIBRARY,
    open_spreadsheet: spreadsheet.LIBRARY,
}
"""What a reader cannot do without."""
_HEAD = 4096
_OF_BYTES = b"\0"
"""What is in the first bytes of every measurement file, whose sizes are numbers of fixed length, and in no text."""


def import_recording(path: str | Path, map_path: str | Path) -> Recording:
    """Read a foreign file by a map of channels; raises FrictionOcpError for an unknown format and all that is wrong."""
    found = import_file(path, map_path)
    if isinstance(found, StaticPoints):
        raise FrictionOcpError(Finding(str(map_path), "the map is one of static points", "channels in place of points"))
    return found


def import_file(path: str | Path, map_path: str | Path) -> Recording | StaticPoints:
    """Read a foreign file by a map: static points where the map has `points`, else a recording."""
    read = _import if _loaded(Path(path)) is open_csv else probed(_import)
    return read(path, map_path)


def _import(path: str | Path, map_path: str | Path) -> Recording | StaticPoints:
    path = Path(path)
    opener, import_map = _opener(path), load_import_map(map_path)
    _refuse_missing(path)
    with opener(path, import_map) as file:
        _refuse_nothing(file, path)
        return (static_points_of if import_map.points else recording_of)(file, import_map, path)


def inspect_file(path: str | Path) -> str:
    """Return what a foreign file holds, one line a signal with its unit, rate, length and range."""
    read = _inspect if _loaded(Path(path)) is open_csv else probed(_inspect)
    return read(path)


def _inspect(path: str | Path) -> str:
    path = Path(path)
    opener = _opener(path)
    _refuse_missing(path)
    with opener(path, None) as file:
        _refuse_nothing(file, path)
        return describe(file, path)


def _loaded(path: Path) -> Opener:
    """Return the reader of a file, with its library loaded."""
    opener = _opener(path)
    if opener in LIBRARIES and path.exists():
        LIBRARIES[opener].load(path)
    return opener


def _opener(path: Path) -> Opener:
    if path.is_dir() and (path / "metadata.yaml").is_file():
        return open_rosbag
    opener = READERS.get(path.suffix.lower())
    if opener is None:
        what = f"no reader for '{path.suffix or path.name}'"
        allowed = f"available: {', '.join(READERS)}, or the folder of a ROS 2 bag"
        raise FrictionOcpError(Finding(str(path), what, allowed, "export the data to one of them"))
    return open_csv if opener is open_mdf and _is_text(path) else opener


def _is_text(path: Path) -> bool:
    """Whether a file is one of text: loggers write that with the ending `.dat`, too."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(_HEAD)
    return head.startswith(UTF16_MARKS) or (bool(head) and _OF_BYTES not in head)


def _refuse_missing(path: Path) -> None:
    if not path.exists():
        raise FrictionOcpError(Finding(str(path), "there is no such file", remedy="correct the path"))
    if path.is_dir() and not (path / "metadata.yaml").is_file():
        raise FrictionOcpError(Finding(str(path), "this is a folder", "a file, or the folder of a ROS 2 bag"))


def _refuse_nothing(file: ForeignFile, path: Path) -> None:
    if not file.signals:
        raise FrictionOcpError(Finding(str(path), f"there is no series in it ({file.summary})", "at least one"))

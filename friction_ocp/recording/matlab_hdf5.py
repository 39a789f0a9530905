"""HDF5 files of other programs, those of MATLAB 7.3 among them: the datasets of numbers in all groups."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py as _h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.attribute_text import attribute_text
from friction_ocp.recording.foreign import ForeignFile, Signal, Values, no_clock, opened, reading, refuse_large
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import ImportMap

h5py: Any = _h5py  # its own types are incomplete

KIND = "an HDF5 file"
MAX_DEPTH = 20
MAX_COLUMNS = 200
"""Columns of a matrix that are listed; images have more and are left out."""
REFERRED = "/#refs#/"
"""Where MATLAB keeps what it refers to."""
MAX_ELEMENTS = 1000
"""Elements of a cell or struct array, and characters of a text, that are listed; longer ones are left out."""
_UNIT_KEYS = ("unit", "units", "Unit", "Units")


@dataclass(frozen=True)
class _Series:
    """One series of values: a vector, or a row or column of a matrix."""

    signal: Signal
    path: str
    where: tuple[Any, ...]
    """What of the dataset it is."""


def is_hdf5(path: Path) -> bool:
    """Whether a file is HDF5, as MATLAB writes since version 7.3."""
    return bool(h5py.is_hdf5(path))


def has_objects_73(path: Path) -> bool:
    """Whether a file of version 7.3 holds objects, and no link by which they could lie in another file.

    Raises FrictionOcpError where one has such a link, or more data than fit into the memory.
    """
    with h5py.File(path, "r") as file:
        if "#subsystem#" not in file:
            return False
        faults, sizes = list[str](), list[int]()

        def look(name: str, link: Any) -> None:
            node = file[name] if isinstance(link, h5py.HardLink) else None
            if node is None or (isinstance(node, h5py.Dataset) and _is_elsewhere(node)):
                faults.append(name)
            elif isinstance(node, h5py.Dataset):
                sizes.append(int(node.nbytes))

        file.visititems_links(look)
    if faults:
        what = f"'{faults[0]}' keeps its data elsewhere"
        raise FrictionOcpError(Finding(str(path), what, "data inside the file", "copy it there"))
    refuse_large(path, sum(sizes), "variables")
    return True


@contextmanager
def open_hdf5(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the datasets of numbers by their paths, `group.name`; nothing outside the file is opened.

    A cell or struct array of MATLAB has elements `name{0}`.
    """
    with opened(path, KIND, lambda: h5py.File(path, "r")) as file:
        series = tuple(_walk(file, "", 0, set()))

        def read(wanted: Sequence[int]) -> Mapping[int, Values]:
            with reading(path, KIND):
                return {k: _values(file, series[k], path) for k in wanted}

        summary = "HDF5, MATLAB 7.3" if path.suffix.lower() == ".mat" else "HDF5"
        yield ForeignFile(tuple(item.signal for item in series), read, no_clock, summary)


def _walk(group: Any, prefix: str, depth: int, seen: set[int]) -> Iterator[_Series]:
    """Yield every series below a group; links out of the file are left out, and what MATLAB refers to is read there.

    `seen` are the addresses of what has been referred to: nothing is read twice.
    """
    for key in group:
        link = group.get(key, getlink=True)
        if not isinstance(link, h5py.HardLink) or key.startswith("#"):
            continue
        node = group[key]
        if h5py.check_ref_dtype(getattr(node, "dtype", np.dtype(int))) is h5py.Reference:
            is_cell = "MATLAB_class" in node.attrs  # each field of a struct array has references and no class
            first, last = (f"{prefix}{key}", "") if is_cell else (prefix.removesuffix("."), f".{key}")
            yield from _referred(node, first, last, depth, seen)
        else:
            yield from _below(node, f"{prefix}{key}", depth, seen)


def _below(node: Any, name: str, depth: int, seen: set[int]) -> Iterator[_Series]:
    if isinstance(node, h5py.Group) and depth < MAX_DEPTH:
        yield from _walk(node, f"{name}.", depth + 1, seen)
    elif isinstance(node, h5py.Dataset):
        yield from _series(node, name)


def _referred(node: Any, first: str, last: str, depth: int, seen: set[int]) -> Iterator[_Series]:
    """Yield the elements of a cell, `name{k}`, or of one field of a struct array, `name{k}.field`."""
    if depth >= MAX_DEPTH or not _is_short(node):
        return
    references: Any = np.ravel(node[()], order="F")
    for index, reference in enumerate(references):
        target = node.file[reference] if reference else None
        if target is None or not (target.name or "").startswith(REFERRED):
            continue
        address = h5py.h5o.get_info(target.id).addr
        if address not in seen:
            seen.add(address)
            yield from _below(target, f"{first}{{{index}}}{last}", depth + 1, seen)


def _series(node: Any, name: str) -> Iterator[_Series]:
    """Yield a vector as it is and a matrix along its longer side."""
    shape: tuple[int, ...] = tuple(node.shape or ())
    longer = int(np.argmax(shape)) if shape else 0
    if len([size for size in shape if size > 1]) <= 1:
        where: tuple[Any, ...] = tuple(slice(None) if axis == longer else 0 for axis in range(len(shape)))
        yield _Series(_signal(node, name, max(shape, default=1)), node.name, where)
        return
    if len(shape) != 2 or min(shape) > MAX_COLUMNS:
        return
    for k in range(min(shape)):
        where = (slice(None), k) if longer == 0 else (k, slice(None))
        yield _Series(_signal(node, f"{name}[{k}]", max(shape)), node.name, where)


def _signal(node: Any, name: str, samples: int) -> Signal:
    unit = attribute_text(next((node.attrs[key] for key in _UNIT_KEYS if key in node.attrs), ""))
    is_text = node.attrs.get("MATLAB_class", b"") in (b"char", "char")
    is_other = node.attrs.get("MATLAB_empty", 0) or node.attrs.get("MATLAB_object_decode", 0)
    numeric = node.dtype.kind in "biuf" and not is_text and not is_other
    return Signal(name, samples, unit or header_unit(name), numeric=numeric, text=_text(node) if is_text else "")


def _text(node: Any) -> str:
    """Return the text of a char array of one line, which is stored as UTF-16."""
    if node.dtype != np.uint16 or not _is_short(node):
        return ""
    return np.ravel(node[()]).tobytes().decode("utf-16-le", errors="replace")


def _is_short(node: Any) -> bool:
    """Whether a dataset is inside the file, not null, and short enough to be read while the file is listed."""
    return node.shape is not None and node.size <= MAX_ELEMENTS and not _is_elsewhere(node)


def _is_elsewhere(node: Any) -> bool:
    """Whether a dataset keeps its data in other files, or has them from other datasets."""
    return bool(node.is_virtual or node.external)


def _values(file: Any, series: _Series, path: Path) -> Values:
    node = file[series.path]
    if _is_elsewhere(node):
        what = f"'{series.signal.name}' keeps its data in other files"
        raise FrictionOcpError(Finding(str(path), what, "data inside the file", "copy it there"))
    return np.atleast_1d(np.asarray(node[series.where] if series.where else node[()]))

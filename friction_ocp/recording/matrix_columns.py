"""Vectors and matrices: a series, or one a column."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from friction_ocp.recording.foreign import Values


def matrix_columns(name: str, values: Values) -> Iterator[tuple[str, Values]]:
    """Yield a vector as it is, a matrix column by column, its longer side being the samples."""
    flat = np.squeeze(values)
    if flat.ndim <= 1:
        yield name, np.atleast_1d(flat)
    elif flat.ndim == 2:
        rows = flat if flat.shape[0] >= flat.shape[1] else flat.T
        for k in range(rows.shape[1]):
            yield f"{name}[{k}]", rows[:, k]

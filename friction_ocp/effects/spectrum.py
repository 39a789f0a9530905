"""Which waves are in a torque that was seen at uneven places."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.ndimage as _ndimage  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.simulation.grid import FloatArray, IntArray

ndimage: Any = _ndimage  # its own types are incomplete

ComplexArray = npt.NDArray[np.complex128]

LINES, MOST_LINES = 600, 4000
"""Frequencies at which a spectrum is looked at."""
AT_ONCE = 100
"""Frequencies for which what a mean leaves of a wave is worked out together."""
NEIGHBOURS = 41
"""Lines over which the level of a spectrum is told, itself in the middle."""


def spectrum(
    place: FloatArray, across: FloatArray, values: FloatArray, factor: FloatArray, frequencies: FloatArray
) -> FloatArray:
    """Return what a wave of each of evenly spaced frequencies takes of squares at uneven places (Lomb 1976).

    Each value is the mean over places as far apart as `across`.
    """
    if not frequencies.size:
        return np.zeros(0)
    plain = values - factor * float(np.sum(factor * values) / max(float(np.sum(factor**2)), 1e-300))
    power = list[FloatArray]()
    for some in np.array_split(frequencies, max(1, -(-frequencies.size // AT_ONCE))):
        seen = factor * left_by_means(0.5 * float(some[0] + some[-1]), across)
        pulled, squares = seen * plain, seen**2
        whole, waves = float(np.sum(squares)), _waves(place, some)
        pull, twice = np.einsum("kn,n->k", waves, pulled), np.einsum("kn,n->k", waves * waves, squares)
        gram = 0.5 * np.array([[whole + twice.real, twice.imag], [twice.imag, whole - twice.real]]).transpose(2, 0, 1)
        both = np.column_stack([pull.real, pull.imag])
        power.append(np.einsum("kp,kpq,kq->k", both, np.linalg.pinv(gram, rcond=1e-9, hermitian=True), both))
    return np.concatenate(power)


def left_by_means(frequency: float, across: FloatArray) -> FloatArray:
    """Return (n,) what means over places as far apart as `across` leave of a wave; nothing if it comes back within.

    What is passed slowly tells of short waves.
    """
    return np.maximum(np.sinc(frequency * across), 0.0)


def _waves(place: FloatArray, frequencies: FloatArray) -> ComplexArray:
    """Return (frequencies, n) waves of evenly spaced frequencies at some places, each from the one before."""
    turns = 2.0j * np.pi * place
    waves = np.empty((frequencies.size, place.size), dtype=complex)
    waves[0] = np.exp(turns * frequencies[0])
    waves[1:] = np.exp(turns * (frequencies[-1] - frequencies[0]) / max(frequencies.size - 1, 1))
    return np.multiply.accumulate(waves, axis=0)


def without(values: FloatArray, shapes: FloatArray) -> FloatArray:
    """Return (n,) values without what (n, shapes) shapes do of them."""
    size = np.linalg.norm(shapes, axis=0)
    own = shapes / np.where(size > 0, size, 1.0)
    return values - own @ np.linalg.lstsq(own, values, rcond=None)[0]


def peaks(power: FloatArray, beyond: FloatArray, most: int) -> list[int]:
    """Return the places of `most` peaks of two spectra, in turn of the highest and of those highest over their level.

    `power` is that of all that is missing, `beyond` that of what parameters cannot make up for.
    """
    orders = [order for of in (power, beyond) for order in _by_height(of, (of, of / _level(of)))]
    longest = max(order.size for order in orders)
    in_turn = [int(order[k]) for k in range(longest) for order in orders if k < order.size]
    return list(dict.fromkeys(in_turn))[:most]


def _by_height(power: FloatArray, heights: Sequence[FloatArray]) -> list[IntArray]:
    """Return the places of all peaks of a spectrum in the orders of several heights."""
    inner = np.concatenate([[-np.inf], power, [-np.inf]])
    found = np.flatnonzero((inner[1:-1] >= inner[:-2]) & (inner[1:-1] >= inner[2:]))
    return [found[np.argsort(-height[found])] for height in heights]


def _level(power: FloatArray) -> FloatArray:
    return np.maximum(ndimage.median_filter(power, NEIGHBOURS, mode="nearest"), 1e-300)

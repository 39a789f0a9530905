"""A problem file as a template: numbers with their true values, and what the handbook says of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

Keys = tuple[str | int, ...]


MOST_OFF = 2.5
"""Deviations of its spread by which a guess is off, at most."""


@dataclass(frozen=True)
class Number:
    """A number of the machine.

    `spread` is the relative standard deviation of the handbook's value about the true one; 0 means that it is known and
    stands fixed in the file. With `stated` the file gives the handbook's value as a prior with that deviation.
    `varies` is the relative standard deviation of the true value from machine to machine.
    """

    true: float
    spread: float = 0.0
    stated: bool = False
    varies: float = 0.15


def numbers(document: Any, path: Keys = ()) -> Iterator[tuple[Keys, Number]]:
    """Yield every number of a template with its place."""
    items = document.items() if isinstance(document, Mapping) else enumerate(document)
    for key, value in items:
        if isinstance(value, Number):
            yield (*path, key), value
        elif isinstance(value, (Mapping, list)):
            yield from numbers(value, (*path, key))


def mapped(document: Any, change: Callable[[Number], Any]) -> Any:
    """Return a template with every number replaced."""
    if isinstance(document, Number):
        return change(document)
    if isinstance(document, Mapping):
        return {key: mapped(value, change) for key, value in document.items()}
    return [mapped(value, change) for value in document] if isinstance(document, list) else document


def with_true(document: Any, path: Keys, factor: float) -> Any:
    """Return a template whose number at `path` has `factor` times its true value."""
    if not path:
        return replace(document, true=document.true * factor)
    if isinstance(document, Mapping):
        return {k: with_true(v, path[1:], factor) if k == path[0] else v for k, v in document.items()}
    return [with_true(v, path[1:], factor) if k == path[0] else v for k, v in enumerate(document)]


def varied(document: Any, rng: np.random.Generator) -> Any:
    """Return the template of another machine of the kind."""
    return mapped(document, lambda n: replace(n, true=n.true * float(np.exp(n.varies * rng.standard_normal()))))


def truth(document: Any) -> Any:
    """Return the document with its true values."""
    return mapped(document, lambda n: n.true)


def handbook(document: Any, rng: np.random.Generator) -> Any:
    """Return the document as the handbook has it: what is known, and guesses that are off.

    No further than MOST_OFF: what lies beyond three deviations of its prior is wrong, which is an effect of its own.
    """

    def entry(number: Number) -> Any:
        if number.spread == 0.0:
            return float(f"{number.true:.9g}")
        off = np.clip(rng.standard_normal(), -MOST_OFF, MOST_OFF)
        guess = float(f"{number.true * np.exp(number.spread * off):.4g}")
        bounds = {"guess": guess, "min": 0.02 * guess, "max": 50.0 * guess}
        return bounds | ({"prior_std": float(f"{number.spread * guess:.3g}")} if number.stated else {})

    return mapped(document, entry)

"""Functions of lanes against those of NumPy, special values included."""

from __future__ import annotations

import ctypes
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from friction_ocp.simulation.compiled import FLAGS, compiler, lane_headers, load_library, vector_flags
from friction_ocp.simulation.lane_code import lane_code

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

WIDTHS = (("-DLANES=2",), vector_flags())
LAST_PLACES = 2
SPECIAL = [0.0, np.inf, -np.inf, np.nan, 1e-310, -1e-310, 5e-324, 1e308, -1e308, 1.0, -1.0]
CALL = """
void apply(long count, const double *one, const double *two, double *out) {
  for (long k = 0; k < count; k += LANES) {
    lanes x, y, z;
    const lanes *arg[] = {&x, &y};
    lanes *res[] = {&z};
    int live = count - k < LANES ? count - k : LANES;
    for (int i = 0; i < LANES; ++i) x[i] = one[i < live ? k + i : k], y[i] = two[i < live ? k + i : k];
    f(arg, res, live);
    for (int i = 0; i < live; ++i) out[k + i] = z[i];
  }
}
"""
X, Y = ca.SX.sym("x"), ca.SX.sym("y")
ALIKE = ("exp", "expm1", "log", "log1p", "tanh", "sin", "cos", "sqrt", "fabs", "sign", "floor", "ceil", "fmin", "fmax")
"""Functions that CasADi and NumPy call the same."""
SAME = {name: (getattr(ca, name), getattr(np, name)) for name in ALIKE}
UNARY = {name: SAME[name] for name in ALIKE[:-2]} | {"atan": (ca.atan, np.arctan)}
BINARY = {
    **{name: SAME[name] for name in ALIKE[-2:]},
    "pow": (lambda x, y: x**y, np.power),
    "atan2": (ca.atan2, np.arctan2),
    "less": (lambda x, y: ca.if_else(x < y, x, 2.0 * y), lambda x, y: np.where(x < y, x, 2.0 * y)),
    "logic": (
        lambda x, y: ca.logic_and(ca.logic_not(x > 0), ca.logic_or(y > 0, x == y)) + 3.0,
        lambda x, y: (~(x > 0) & ((y > 0) | (x == y))) + 3.0,
    ),
}


def apply(value: ca.SX, one: np.ndarray, two: np.ndarray, width: tuple[str, ...], folder: Path) -> np.ndarray:
    """Return a function of x and y, compiled for lanes of some width, at each pair of numbers."""
    program = compiler()
    assert program is not None
    source = "\n".join((lane_headers(), lane_code(ca.Function("f", [X, Y], [value])), CALL))
    library, out = load_library(source, program, folder, (*FLAGS, *width)), np.empty_like(one)
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in (one, two, out)]
    library.apply(ctypes.c_long(one.size), *pointers)
    return out


def arguments() -> np.ndarray:
    """Return numbers of all sizes and signs, and special ones."""
    rng = np.random.default_rng(0)
    sizes = np.exp(rng.uniform(-30.0, 8.0, 2000)) * rng.choice([-1.0, 1.0], 2000)
    around = np.concatenate([rng.uniform(-2.0, 2.0, 500), rng.uniform(-760.0, 760.0, 300)])
    return np.concatenate([sizes, around, 1.0 + 1e-8 * around, np.arange(-8, 9) * 0.5 * np.pi, [3e7], SPECIAL])


def assert_same(found: np.ndarray, expected: np.ndarray, scale: np.ndarray | float = 0.0) -> None:
    """Compare numbers to their last places, or to those of a scale, beyond the smallest normal number."""
    finite = np.isfinite(expected)
    assert np.array_equal(found[~finite], expected[~finite], equal_nan=True)
    room = LAST_PLACES * np.spacing(np.maximum(np.abs(expected), scale))
    off = np.abs(found - expected)[finite]
    allowed = np.broadcast_to(np.maximum(room, 1e-307), expected.shape)[finite]
    assert np.all(off <= allowed), (found[finite][off > allowed], expected[finite][off > allowed])


@pytest.mark.parametrize("width", WIDTHS, ids=lambda width: width[0])
@pytest.mark.parametrize("name", UNARY)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_functions_of_one_number(name: str, width: tuple[str, ...], tmp_path: Path) -> None:
    """Sines and cosines are compared with what they swing between, all else with itself."""
    ours, theirs = UNARY[name]
    x = arguments()
    found = apply(ours(X), x, x, width, tmp_path)
    assert_same(found, theirs(x), 1.0 if name in ("sin", "cos") else 0.0)


@pytest.mark.parametrize("width", WIDTHS, ids=lambda width: width[0])
@pytest.mark.parametrize("name", BINARY)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_functions_of_two_numbers(name: str, width: tuple[str, ...], tmp_path: Path) -> None:
    """Where one of them is not a number, too."""
    ours, theirs = BINARY[name]
    x = arguments()
    y = np.random.default_rng(1).permutation(x)
    assert_same(apply(ours(X, Y), x, y, width, tmp_path), theirs(x, y))

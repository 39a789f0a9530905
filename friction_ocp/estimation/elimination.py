"""Solution of a Gauss-Newton system by eliminating the node states segment by segment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as _linalg  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.estimation.program import Blocks, Linearisation
from friction_ocp.simulation.grid import FloatArray

linalg: Any = _linalg

SINGULAR = 1e-12
"""Eigenvalue over the largest, of a system with ones on its diagonal, below which rounding alone makes it."""


@dataclass(frozen=True)
class Eliminated:
    """Nodes of one recording as affine functions of the parameter step."""

    constant: FloatArray
    """(segments, states)."""
    by_theta: FloatArray
    """(segments, states, parameters)."""


@dataclass(frozen=True)
class Reduced:
    """The system in the parameters alone, and the way back to the nodes."""

    hessian: FloatArray
    gradient: FloatArray
    recordings: tuple[Eliminated, ...]

    def node_steps(self, step: FloatArray, follow: bool = False) -> tuple[FloatArray, ...]:
        """Return the node steps that belong to a parameter step; those that `follow` it have no part of their own."""
        own = 0.0 if follow else 1.0
        return tuple(own * item.constant + np.tensordot(item.by_theta, step, 1) for item in self.recordings)


def reduce_system(system: Linearisation, damping: float, scale: FloatArray | None = None) -> Reduced:
    """Eliminate all nodes; `damping` times its diagonal is added to the Hessian (Levenberg-Marquardt).

    For the parameters it is `damping` times `scale` (parameters,) where that is given.
    """
    own = np.diag(system.theta_theta) if scale is None else scale
    hessian = system.theta_theta + damping * np.diag(own)
    gradient = system.theta_gradient.copy()
    recordings: list[Eliminated] = []
    for blocks in system.blocks:
        eliminated = _eliminate(blocks, damping)
        hessian += np.einsum("kip,kiq->pq", blocks.node_theta, eliminated.by_theta)
        gradient += np.einsum("kip,ki->p", blocks.node_theta, eliminated.constant)
        recordings.append(eliminated)
    return Reduced(0.5 * (hessian + hessian.T), gradient, tuple(recordings))


def _eliminate(blocks: Blocks, damping: float) -> Eliminated:
    """Solve the block-tridiagonal node system for -[gradient, node_theta]."""
    right = -np.concatenate([blocks.node_gradient[:, :, None], blocks.node_theta], axis=2)
    diagonal = blocks.node_node.copy()
    index = np.arange(int(right.shape[1]))
    diagonal[:, index, index] *= 1.0 + damping
    diagonal[:, index, index] += 1e-14 * (1.0 + diagonal[:, index, index])
    joined = bool(np.any(blocks.node_next))
    solved = _chained(diagonal, blocks.node_next, right) if joined else _solve(diagonal, right)
    return Eliminated(solved[:, :, 0], solved[:, :, 1:])


def _chained(diagonal: FloatArray, upper: FloatArray, right: FloatArray) -> FloatArray:
    """Solve a symmetric block-tridiagonal system, by Cholesky's method where it is positive definite.

    `diagonal` (n, s, s), `upper` (n - 1, s, s) right of the diagonal, `right` (n, s, k).
    """
    count, states, columns = right.shape
    band = np.zeros((2 * states, count, states))
    for row in range(states):
        for column in range(states):
            if row <= column:
                band[2 * states - 1 + row - column, :, column] = diagonal[:, row, column]
            band[states - 1 + row - column, 1:, column] = upper[:, row, column]
    flat = (band.reshape(2 * states, -1), right.reshape(-1, columns))
    try:
        solved: FloatArray = np.asarray(linalg.solveh_banded(*flat, overwrite_ab=True, check_finite=False))
        return solved.reshape(right.shape)
    except np.linalg.LinAlgError:
        return _cyclic_reduction(diagonal, upper, right)


def _cyclic_reduction(diagonal: FloatArray, upper: FloatArray, right: FloatArray) -> FloatArray:
    """Solve a symmetric block-tridiagonal system: every other block at once, then what is left.

    Rounding may have taken the last digit that made it positive. Source: Golub, Van Loan, Matrix Computations, 4.5.4.
    """
    if len(diagonal) == 1:
        return _solve(diagonal, right)
    half = halved(diagonal, upper, right)
    kept = _cyclic_reduction(half.diagonal, half.upper, half.right)
    odd, inner = len(half.alone), len(kept) - 1
    result = np.empty_like(right)
    result[0::2] = kept
    result[1::2] = half.alone - half.to_left @ kept[:odd]
    result[1::2][:inner] -= half.to_right[:inner] @ kept[1 : inner + 1]
    return result


@dataclass(frozen=True)
class Halved:
    """A block-tridiagonal system without every other block, and how those hang on what is left."""

    diagonal: FloatArray
    upper: FloatArray
    right: FloatArray
    alone: FloatArray
    """(left out, states, k) solution of the blocks left out where their neighbours are zero."""
    to_left: FloatArray
    to_right: FloatArray
    """(left out, states, states) how much of the neighbour before and after is to be taken off."""


def halved(diagonal: FloatArray, upper: FloatArray, right: FloatArray) -> Halved:
    """Eliminate the second, fourth ... block of a symmetric block-tridiagonal system of two or more blocks.

    `diagonal` (n, s, s), `upper` (n - 1, s, s) right of the diagonal, `right` (n, s, k).
    """
    odd, states = len(diagonal) // 2, diagonal.shape[1]
    before, after = upper[0::2], upper[1::2]
    following = after if len(after) == odd else np.concatenate([after, np.zeros((1, states, states))])
    sides = [before.transpose(0, 2, 1), following, right[1::2]]
    solved = _solve(diagonal[1::2], np.concatenate(sides, axis=2))
    to_left, to_right, alone = solved[:, :, :states], solved[:, :, states : 2 * states], solved[:, :, 2 * states :]
    even, rest = diagonal[0::2].copy(), right[0::2].copy()
    even[:odd] -= before @ to_left
    rest[:odd] -= before @ alone
    back, inner = after.transpose(0, 2, 1), len(after)
    even[1 : inner + 1] -= back @ to_right[:inner]
    rest[1 : inner + 1] -= back @ alone[:inner]
    coupling = -(before[: len(even) - 1] @ to_right[: len(even) - 1])
    return Halved(even, coupling, rest, alone, to_left, to_right)


def _solve(matrices: FloatArray, right: FloatArray) -> FloatArray:
    try:
        return np.asarray(np.linalg.solve(matrices, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        return _solve_singular(matrices, right)


def _solve_singular(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Solve symmetric systems some of which rounding has left singular, in units that make their diagonals one.

    Where a simulation is about to break down derivatives grow beyond all sense, and nothing of smaller ones is left
    beside them: what cannot be told stays where it is.
    """
    size = np.sqrt(np.abs(np.diagonal(matrices, axis1=1, axis2=2)))
    unit = 1.0 / np.where((size > 0.0) & np.isfinite(size), size, np.inf)
    with np.errstate(invalid="ignore", over="ignore"):
        scaled, wanted = (
            np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
            for values in (unit[:, :, None] * matrices * unit[:, None, :], unit[:, :, None] * right)
        )
    inverse = np.linalg.pinv(scaled, rcond=SINGULAR, hermitian=True)
    return np.asarray(unit[:, :, None] * (inverse @ wanted), dtype=np.float64)

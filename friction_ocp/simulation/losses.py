"""Losses of a residual in units of its noise floor: the cost of an error and the weight it gets."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from friction_ocp.simulation.grid import FloatArray


class AbstractLoss(ABC):
    """Cost rho(r) of a residual, and rho'(r) / r, its weight in an iteratively reweighted step."""

    code: ClassVar[int]
    """What native code (`cost_of` in sweep.c) calls it."""

    @property
    @abstractmethod
    def parameter(self) -> float:
        """The number that native code gets with it; 0 where there is none."""

    @abstractmethod
    def cost(self, residual: FloatArray) -> FloatArray:
        """Return rho elementwise."""

    @abstractmethod
    def weight(self, residual: FloatArray) -> FloatArray:
        """Return rho'(r) / r elementwise."""

    @abstractmethod
    def curvature(self, residual: FloatArray) -> FloatArray:
        """Return rho''(r) elementwise."""


@dataclass(frozen=True)
class Squares(AbstractLoss):
    """Half the square: the likelihood of normal noise."""

    code: ClassVar[int] = 0

    @property
    def parameter(self) -> float:
        return 0.0

    def cost(self, residual: FloatArray) -> FloatArray:
        return 0.5 * residual**2

    def weight(self, residual: FloatArray) -> FloatArray:
        return np.ones_like(residual)

    def curvature(self, residual: FloatArray) -> FloatArray:
        return np.ones_like(residual)


@dataclass(frozen=True)
class Absolute(AbstractLoss):
    """|r|, rounded below `rounding`: the likelihood of Laplace noise."""

    rounding: float
    code: ClassVar[int] = 1

    @property
    def parameter(self) -> float:
        return self.rounding

    def cost(self, residual: FloatArray) -> FloatArray:
        return np.sqrt(residual * residual + self.rounding**2) - self.rounding

    def weight(self, residual: FloatArray) -> FloatArray:
        return 1.0 / np.sqrt(residual * residual + self.rounding**2)

    def curvature(self, residual: FloatArray) -> FloatArray:
        return self.rounding**2 * self.weight(residual) ** 3


@dataclass(frozen=True)
class Huber(AbstractLoss):
    """Square near zero, linear beyond `knee` noise floors. Source: Huber 1964."""

    knee: float = 1.345
    code: ClassVar[int] = 2

    @property
    def parameter(self) -> float:
        return self.knee

    def cost(self, residual: FloatArray) -> FloatArray:
        size = np.abs(residual)
        return np.where(size <= self.knee, 0.5 * size**2, self.knee * (size - 0.5 * self.knee))

    def weight(self, residual: FloatArray) -> FloatArray:
        return np.minimum(1.0, self.knee / np.maximum(np.abs(residual), 1e-300))

    def curvature(self, residual: FloatArray) -> FloatArray:
        return (np.abs(residual) <= self.knee).astype(float)


@dataclass(frozen=True)
class StudentT(AbstractLoss):
    """Negative log-likelihood of Student's t noise. Source: Lange, Little, Taylor 1989."""

    freedom: float = 4.0
    code: ClassVar[int] = 3

    @property
    def parameter(self) -> float:
        return self.freedom

    def cost(self, residual: FloatArray) -> FloatArray:
        return 0.5 * (self.freedom + 1.0) * np.log1p(residual**2 / self.freedom)

    def weight(self, residual: FloatArray) -> FloatArray:
        return (self.freedom + 1.0) / (self.freedom + residual**2)

    def curvature(self, residual: FloatArray) -> FloatArray:
        squared = residual**2
        return (self.freedom + 1.0) * (self.freedom - squared) / (self.freedom + squared) ** 2

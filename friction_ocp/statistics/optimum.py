"""Where a fit ended, as a file can hold it, and the program that it ended with."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from friction_ocp.estimation.gauss_newton import Solution
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.rounds import Fitted, program_builder
from friction_ocp.simulation.losses import Absolute, AbstractLoss, Huber, Squares, StudentT

LOSSES: Mapping[str, type[AbstractLoss]] = {loss.__name__: loss for loss in (Absolute, Huber, Squares, StudentT)}


@dataclass(frozen=True)
class Optimum:
    """The end of a fit."""

    solution: Solution
    loss: AbstractLoss

    @classmethod
    def of(cls, fitted: Fitted) -> Optimum:
        """Take the end of a fit without its program."""
        return cls(fitted.solution, fitted.program.loss)

    def fitted(self, model: Model) -> Fitted:
        """Return the fit with the program that it ended with: exact friction, the loss as it was."""
        return Fitted(self.solution, program_builder(model)(model, 0.0, self.loss))

    def document(self) -> dict[str, Any]:
        """Return plain values; an objective that is not finite becomes None."""
        solution, objective = self.solution, self.solution.objective
        facts = {item.name: getattr(solution, item.name) for item in dataclasses.fields(solution)}
        return {
            **facts,
            "point": {
                "theta": solution.point.theta.tolist(),
                "nodes": [nodes.tolist() for nodes in solution.point.nodes],
            },
            "objective": float(objective) if np.isfinite(objective) else None,
            "loss": {"name": type(self.loss).__name__, **dataclasses.asdict(self.loss)},  # pyright: ignore[reportArgumentType]
        }

    @classmethod
    def read(cls, content: Mapping[str, Any]) -> Optimum:
        """Return the optimum that `document` describes."""
        facts = {key: value for key, value in content.items() if key not in ("point", "loss", "objective")}
        nodes = tuple(np.array(item, dtype=np.float64) for item in content["point"]["nodes"])
        point = Point(np.array(content["point"]["theta"], dtype=np.float64), nodes)
        objective = np.inf if content["objective"] is None else float(content["objective"])
        numbers = dict(content["loss"])
        return cls(Solution(point=point, objective=objective, **facts), LOSSES[numbers.pop("name")](**numbers))

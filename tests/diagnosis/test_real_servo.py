"""A servo as it was measured: models far from its recordings are compared on conditions that they have not seen."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.problem_file.load import load_problem

PROBLEM = Path(__file__).parents[2] / "problems" / "xl330" / "coulomb_viscous.yaml"


FOUND = {
    True: (("torque_saturation", "servo"), ("load_dependence", "servo")),
    False: (("load_dependence", "servo"),),
}
"""Free runs say for certain that torque falls with current, too, at the gain that is left out of a fit to the other
one. At the third, which took no part, that is no help and no harm."""


@pytest.mark.slow
@pytest.mark.parametrize("stated", [True, False])
def test_friction_that_grows_with_the_load_is_found_and_carries_over(stated: bool, tmp_path: Path) -> None:
    """Whether models are fitted to free runs, as the problem states, or as if nothing were stated.

    Nothing of the catalogue takes all; what comes nearer where it was fitted is worse at gains left out, or ends where
    it is no effect.
    """
    document = yaml.safe_load(PROBLEM.read_text(encoding="utf-8"))
    document["estimation"] = document["estimation"] if stated else {}
    for item in (*document["recordings"]["train"], *document["recordings"]["validation"]):
        item["file"] = str((PROBLEM.parent / item["file"]).resolve())
    path = tmp_path / "problem.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    found = diagnose(load_problem(path))
    assert found.accepted == FOUND[stated]
    assert found.closed.interval95[0] > 0.0
    assert found.left_over

"""What an export costs: the servo is identified, exported to MuJoCo, and run there beside the free run here.

python problems/benchmarks/formats.py [--quick]

`--quick` takes the guesses for the answer. The exit status is 1 where MuJoCo adds 2 % of the free-run error or more.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

from friction_ocp.estimation.estimate import identify
from friction_ocp.problem_file.load import load_problem
from friction_ocp.result_folder import fitted_problem
from friction_ocp.targets.fitted import load_fitted
from friction_ocp.targets.joints import joint_drive
from friction_ocp.targets.mjcf import mjcf_text
from friction_ocp.targets.mujoco_run import MuJoCoRun
from friction_ocp.targets.price import price_table, price_text

PROBLEM = Path(__file__).parents[1] / "xl330" / "coulomb_viscous.yaml"
MOST_ADDED = 0.02


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table of the gap that MuJoCo adds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the guesses for the answer")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as place:
        path = PROBLEM
        if not options.quick:
            path = Path(place) / "fitted.yaml"
            text = fitted_problem(identify(load_problem(PROBLEM)), path.parent)
            assert text is not None
            path.write_text(text, encoding="utf-8")
        fitted = load_fitted(path)
        drive = joint_drive(fitted)
        rows = price_table(fitted, MuJoCoRun(fitted, drive, mjcf_text(drive, fitted.name), False).simulate)
    print(price_text(rows, "MuJoCo"))
    return int(max(row.share for row in rows) >= MOST_ADDED)


if __name__ == "__main__":
    raise SystemExit(main())

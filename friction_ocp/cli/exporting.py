"""`export`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from friction_ocp.cli.options import DONE, refuse_overwriting
from friction_ocp.errors import FrictionOcpError

DEAR = 0.1
"""Share of the free-run error above which another model is worth fitting for the target."""


def add_commands(commands: Any) -> None:
    """Add `export` to the parser."""
    exporting = commands.add_parser("export", help="a fitted drive for another program, and what that costs")
    exporting.add_argument("result", type=Path, help="result folder, its result.json, or its fitted.yaml")
    exporting.add_argument("--to", required=True, choices=("mjcf", "urdf", "fmu", "c", "table"))
    exporting.add_argument("--out", type=Path, required=True, help="file to write")
    exporting.add_argument("--no-price", action="store_true", help="do not run the recordings in the target")
    exporting.set_defaults(run=_export)


def _export(options: argparse.Namespace) -> int:
    from friction_ocp.targets.c_source import compensation_width
    from friction_ocp.targets.compensation_words import compensation_text
    from friction_ocp.targets.export import export
    from friction_ocp.targets.fitted import files_of, load_fitted
    from friction_ocp.targets.price import judged_by, price_text
    from friction_ocp.targets.tracking import tracking_gain, tracking_text

    fitted = load_fitted(options.result)
    for written in (options.out, options.out.with_suffix(".h")) if options.to == "c" else (options.out,):
        refuse_overwriting(written, files_of(fitted))
    exported = export(fitted, options.to, options.out)
    for path in exported.files:
        print(f"Written: {path}")
    for doubt in exported.doubts:
        print(f"Doubtful: {doubt}")
    for loss in exported.losses:
        print(f"Not expressed: {loss}")
    if options.to == "c":
        print(compensation_text(fitted, compensation_width(fitted)))
    if exported.no_price:
        print(f"What it costs is not measured: {exported.no_price}.")
    if options.no_price or exported.price is None or not fitted.model.problem.recordings:
        return DONE
    try:
        rows = exported.price()
    except FrictionOcpError as error:
        for finding in error.findings:
            print(f"warning: {finding}", file=sys.stderr)
        return DONE
    print(f"What it costs, on the {judged_by(fitted)} (rms):")
    print(price_text(rows, exported.simulator))
    if exported.losses and max(row.share for row in rows) > DEAR:
        print(f"The gap is large: fit a model that {options.to} can express for it, such as law: coulomb_viscous.")
    if options.to == "c" and (gains := tracking_gain(fitted)):
        print(tracking_text(gains))
    return DONE

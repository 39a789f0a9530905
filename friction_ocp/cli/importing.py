"""`import`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from friction_ocp.cli.options import DONE, refuse_overwriting
from friction_ocp.errors import Finding, FrictionOcpError


def add_commands(commands: Any) -> None:
    """Add `import` to the parser."""
    importing = commands.add_parser("import", help="turn a log into a recording")
    importing.add_argument("file", type=Path)
    importing.add_argument("--map", type=Path, help="YAML file that names columns and units")
    importing.add_argument("--out", type=Path, help="recording to write, .h5")
    importing.add_argument("--inspect", action="store_true", help="list what the file holds and stop")
    importing.set_defaults(run=_import)


def _import(options: argparse.Namespace) -> int:
    from friction_ocp.recording.doubts import doubts_of_import
    from friction_ocp.recording.hdf5 import write_recording, write_static_points
    from friction_ocp.recording.import_map import load_import_map
    from friction_ocp.recording.import_recording import import_file, inspect_file
    from friction_ocp.recording.recording import Recording

    if options.inspect:
        print(inspect_file(options.file))
        return DONE
    missing = [name for name in ("map", "out") if getattr(options, name) is None]
    if missing:
        raise FrictionOcpError(
            [Finding("import", f"--{name} is missing", remedy="see friction-ocp import --help") for name in missing]
        )
    if options.out.is_dir():
        raise FrictionOcpError(Finding(str(options.out), "this is a folder", "a file, such as log.h5"))
    refuse_overwriting(options.out, (options.file, options.map, *options.file.glob("*")))
    found = import_file(options.file, options.map)
    if isinstance(found, Recording):
        for doubt in doubts_of_import(found, load_import_map(options.map)):
            print(f"{doubt.severity}: {doubt}", file=sys.stderr)
        write_recording(found, options.out)
        print(f"Recording: {options.out}")
    else:
        write_static_points(found, options.out)
        print(f"Static points: {options.out}")
    return DONE

"""`init`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from friction_ocp.cli.options import DONE
from friction_ocp.errors import Finding, FrictionOcpError


def add_commands(commands: Any) -> None:
    """Add `init` to the parser."""
    drafting = commands.add_parser("init", help="write the first draft of a problem file")
    drafting.add_argument("source", nargs="?", help="template, or a model in MJCF or URDF; asked for without it")
    drafting.add_argument("--joint", help="joint of the model")
    drafting.add_argument("--recordings", type=Path, default=Path(), help="folder of the recordings; default here")
    drafting.add_argument("--out", type=Path, default=Path("problem.yaml"), help="file to write; default problem.yaml")
    drafting.set_defaults(run=_init)


def _init(options: argparse.Namespace) -> int:
    from friction_ocp.drafts.draft import init
    from friction_ocp.drafts.questions import axis_of_answers

    _refuse_silence(options.source)
    source = axis_of_answers(input) if options.source is None else options.source
    recorded = init(source, options.recordings, options.out, options.joint)
    print(
        f"Written: {options.out}, with {len(recorded.train)} recordings to fit and {len(recorded.validation)} to judge"
    )
    for name, channel in recorded.channels.items():
        print(f"  {name}: {channel['measures']}")
    if recorded.left_out:
        print(f"Not used: {', '.join(recorded.left_out)}")
    for finding in recorded.unread:
        print(f"warning: not read: {finding}", file=sys.stderr)
    print(f"Edit it, then: friction-ocp check {options.out}")
    return DONE


def _refuse_silence(source: str | None) -> None:
    from friction_ocp.drafts.axis import TEMPLATES

    if source is None and not sys.stdin.isatty():
        allowed = f"a template ({', '.join(TEMPLATES)}), or a model in MJCF or URDF"
        raise FrictionOcpError(Finding("init", "nothing is named, and there is no terminal to ask on", allowed))

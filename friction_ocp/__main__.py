"""`python -m friction_ocp` is the command `friction-ocp`."""

from friction_ocp.cli import main

raise SystemExit(main())

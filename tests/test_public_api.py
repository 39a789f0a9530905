"""The names that `import friction_ocp` offers, and what it costs."""

from __future__ import annotations

import argparse
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import friction_ocp
from friction_ocp.cli import _parser

IMPORT_SECONDS = 0.5
SPARED = ("casadi", "matplotlib", "h5py", "numpy", "scipy", "pydantic", "yaml", "pint", "plotly", "rich")


@pytest.mark.parametrize("name", friction_ocp.__all__)
def test_every_public_name_is_there_every_time(name: str) -> None:
    """A public name is the thing itself, however often it is asked for and whatever was imported before."""
    thing = getattr(friction_ocp, name)
    assert callable(thing)
    assert getattr(friction_ocp, name) is thing
    assert thing.__name__ == name


def test_no_public_name_is_the_name_of_a_module() -> None:
    """Importing a module of that name would put it in the place of the public thing."""
    folder = Path(friction_ocp.__file__).parent
    modules = {path.stem for path in folder.iterdir()}
    assert modules.isdisjoint(friction_ocp.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    """A misspelt name fails as it does on any module."""
    with pytest.raises(AttributeError, match="no attribute 'identfy'"):
        getattr(friction_ocp, "identfy")  # noqa: B009


def test_importing_the_package_is_quick() -> None:
    """`import friction_ocp` takes under half a second, the least of three, and loads none of the libraries."""
    code = f"""
import sys, time
began = time.perf_counter()
import friction_ocp
from friction_ocp.cli import _parser
print(time.perf_counter() - began, *[name for name in {SPARED!r} if name in sys.modules])
"""
    runs = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
        for _ in range(3)
    ]
    assert min(float(run[0]) for run in runs) < IMPORT_SECONDS
    assert runs[0][1:] == []


KEYWORD = {"import": "import_recording"}
"""A command whose name Python does not allow for a function."""


def test_every_command_has_its_function() -> None:
    """What the command line does is called by the same name in Python."""
    (commands,) = (action for action in _parser()._actions if isinstance(action, argparse._SubParsersAction))
    functions = {KEYWORD.get(name, name) for name in commands.choices}
    assert functions <= set(friction_ocp.__all__)
    assert all(inspect.isfunction(getattr(friction_ocp, name)) for name in functions)

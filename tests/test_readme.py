"""The README says what is true: its commands, its tables, and its code, which runs."""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import re
import tomllib
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
import yaml
from servo_problem import REPOSITORY, servo_document, write_problem

from friction_ocp.cli import _parser
from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.drive.parts import Channel, Controller, ControllerType, Gravity, Motor, Shaft, Transmission
from friction_ocp.effects import registry as effect_registry
from friction_ocp.effects.registry import register_effect
from friction_ocp.estimation.estimate import simulate
from friction_ocp.friction import registry
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.registry import register_law
from friction_ocp.problem_file.check import check
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.import_map import load_import_map

README = (REPOSITORY / "README.md").read_text(encoding="utf-8")
EXAMPLE_LINES = 25


def blocks(language: str) -> list[str]:
    """Return the fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def table(heading: str) -> dict[str, str]:
    """Return the rows of the table that begins with a heading: first cell -> the others."""
    _, _, rest = README.partition(f"\n| {heading} |")
    rows = re.match(r"[^\n]*\n\|---.*?\n((?:\|.*\n)*)", rest)
    assert rows, f"no table '{heading}'"
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[1].splitlines()]
    return {first.strip("`"): " | ".join(others) for first, *others in cells}


def quoted(text: str) -> tuple[str, ...]:
    """Return what stands between backquotes."""
    return tuple(re.findall(r"`([^`]*)`", text))


def test_there_are_two_commands_of_one_line_each() -> None:
    """The first identifies the servo, the second runs the tests; neither needs anything else before it."""
    first, second = (block.splitlines() for block in blocks("sh"))
    assert len(first) == len(second) == 1
    assert all(line.startswith("python3 -m venv .venv && .venv/bin/pip install -q ") for line in first + second)
    assert first[0].endswith(".venv/bin/friction-ocp identify problems/xl330/coulomb_viscous.yaml")
    assert second[0].endswith(".venv/bin/pytest")


def test_ci_runs_the_test_command_as_it_stands() -> None:
    """.ci/run has the second command on a line of its own."""
    script = (REPOSITORY / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    assert blocks("sh")[1].strip() in script


def test_the_cluster_needs_three_commands_that_exist() -> None:
    """Scheduler, workers, and a command with the option that hands its tasks to them."""
    scheduler, workers, command = blocks("console")[0].splitlines()
    assert scheduler.startswith("dask scheduler --host 127.0.0.1") and workers.startswith("dask worker 127.0.0.1:")
    options = _parser().parse_args(command.split()[1:])
    assert options.scheduler == workers.split()[2] and options.problem.exists()


def test_the_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The code in the README fits the servo with one parameter more and prints them all."""
    example = blocks("python")[0]
    assert len(example.splitlines()) <= EXAMPLE_LINES
    for name in ("problems", "data"):
        (tmp_path / name).symlink_to(REPOSITORY / name)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(compile(example, "README.md", "exec"), names)
    printed = capsys.readouterr().out
    assert names["estimate"].converged
    assert all(name in printed for name in names["estimate"].values)
    assert "servo.friction.load.coulomb" in printed
    assert printed.splitlines()[-1].startswith("free run on validation: 0.")


def test_the_law_that_it_adds_needs_one_class_and_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Registered, the law of the README is read from a file, checked and simulated under its own parameter names."""
    names: dict[str, Any] = {"__name__": "shear_thinning"}
    exec(compile(blocks("python")[1], "README.md", "exec", dont_inherit=True), names)
    monkeypatch.setattr(registry, "_registered", {})
    assert register_law(names["ShearThinning"]) is names["ShearThinning"]
    document = servo_document()
    numbers = {
        key: {"guess": guess, "min": 0, "max": 20} for key, guess in (("tau_c", 0.01), ("tau_v", 0.05), ("omega_v", 3))
    }
    document["drive"]["shafts"][0]["friction"] = {"law": "shear_thinning", **numbers}
    problem = load_problem(write_problem(tmp_path / "servo.yaml", document))
    assert [str(finding) for finding in check(problem) if finding.severity == "error"] == []
    simulation = simulate(problem)
    assert simulation.train_errors["position"][0].rms < 1.0


def test_the_effect_that_it_adds_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Registered, the effect of the README, 15 lines at most, is named where the plant rubs and its size found."""
    example = blocks("python")[2]
    assert len(example[example.index("class") :].splitlines()) <= 15
    names: dict[str, Any] = {"__name__": "rubbing"}
    exec(compile(example, "README.md", "exec", dont_inherit=True), names)
    monkeypatch.setattr(effect_registry, "_registered", {})
    assert register_effect(names["RubbingEffect"]) is names["RubbingEffect"]
    monkeypatch.syspath_prepend(str(REPOSITORY / "tests" / "diagnosis"))
    cases = importlib.import_module("diagnosis_cases")
    path = cases.write_case(tmp_path, cases.axis(viscous=0.0))
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["shafts"][0]["friction"] = {"law": "none"}
    document["diagnosis"]["effects"] = ["rubbing", "sensor_delay"]
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    found = diagnose(load_problem(path))
    assert found.accepted == (("rubbing", "motor"),)
    assert found.final.values["motor.friction.tau_c"] == pytest.approx(cases.COULOMB, rel=0.02)


def test_the_map_that_it_shows_is_read(tmp_path: Path) -> None:
    """The map of an import is one, with three clocks."""
    (tmp_path / "map.yaml").write_text(blocks("yaml")[0], encoding="utf-8")
    import_map = load_import_map(tmp_path / "map.yaml")
    assert list(import_map.channels) == ["position", "current", "speed"]
    assert import_map.channels["current"].time is not None


def test_the_extras_that_it_names_exist() -> None:
    """Every `friction-ocp[extra]` is an extra of this project."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = set(re.findall(r"friction-ocp\[(\w+)\]", README))
    assert named and named <= project["optional-dependencies"].keys()


def test_the_command_table_is_that_of_the_parser() -> None:
    """Every command that exists is listed, and none that does not."""
    listed = {row.split()[1] for row in table("command") if row.startswith("friction-ocp ")}
    (commands,) = (action for action in _parser()._actions if isinstance(action, argparse._SubParsersAction))
    assert listed == set(commands.choices)


def test_the_law_table_is_that_of_the_registry() -> None:
    """Every law with its numbers, in the order of its fields."""
    fields = {law.name: tuple(item.name for item in dataclasses.fields(law)) for law in registry.BUILT_IN}
    assert {name: quoted(numbers) for name, numbers in table("friction law").items()} == fields


def test_the_part_table_names_existing_numbers() -> None:
    """Transmissions, motors, controllers and gravity have the numbers that are listed."""
    rows = {name.split(",")[0].split(":")[0]: (name, quoted(numbers)) for name, numbers in table("part").items()}
    for name, part in (("transmission", Transmission), ("motor", Motor), ("controller", Controller)):
        listed = rows[name][1]
        assert set(listed) == {item.name for item in dataclasses.fields(part) if "kind" in item.metadata}
    assert set(re.findall(r"`(\w+)", rows["controller"][0])) | {"duty"} == set(ControllerType.__args__)
    assert {item.name for item in dataclasses.fields(Gravity)} == {"torque", "phase"}


def test_the_term_table_names_all_terms_and_their_numbers() -> None:
    """Every optional term of a part is listed once, with the numbers that it has."""
    owners = {"shaft": Shaft, "shaft.friction": FrictionElement, "transmission": Transmission, "motor": Motor}
    terms = {
        f"{place}.{name}": [item.name for item in dataclasses.fields(part)]
        for place, owner in (owners | {"channel": Channel}).items()
        for name, hint in get_type_hints(owner).items()
        for part in get_args(hint)
        if dataclasses.is_dataclass(part) and name not in ("load", "gravity", "external_torque")
    }
    listed = {name: list(quoted(numbers.split("|")[0])) for name, numbers in table("optional term").items()}
    assert listed == terms


def test_the_map_names_every_folder() -> None:
    """Folders of the package and of the repository, all of them and only those that exist."""
    rows = [name for row in table("folder") for name in re.split(r"`, `", row)]
    assert all((REPOSITORY / name).is_dir() for name in rows)
    package = {path.parent for path in (REPOSITORY / "friction_ocp").glob("*/__init__.py")}
    assert {REPOSITORY / name for name in rows} >= package | {
        REPOSITORY / name for name in ("problems", "data", "tests")
    }


def test_the_benchmarks_that_it_names_exist() -> None:
    """Every script in the table of numbers is a file."""
    scripts = re.findall(r"problems/\w+/\w+\.py", README)
    assert scripts
    assert all((REPOSITORY / script).is_file() for script in scripts)


def test_links_to_files_lead_somewhere() -> None:
    """What looks like a path of this repository is one."""
    for text in quoted(README):
        if re.fullmatch(r"(problems|data|tests|friction_ocp)/[\w./-]*", text):
            assert (REPOSITORY / text).exists(), text

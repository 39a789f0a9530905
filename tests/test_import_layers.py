"""Imports go only downwards, and what is confined to one module stays there."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "friction_ocp"

LAYERS: tuple[tuple[str, ...], ...] = (
    ("errors", "whole_file", "kept", "whereabouts"),
    ("execution", "optional_library"),
    ("quantities", "parameters", "expressions", "dae"),
    ("friction",),
    ("drive",),
    ("simulation", "recording"),
    ("estimation", "effects"),
    ("statistics",),
    ("diagnosis", "plots", "result_document", "progress_bar"),
    ("excitation",),
    ("problem_file",),
    ("report", "statistics_document", "diagnosis_document", "design_document", "fleet", "targets", "drafts"),
    ("result_folder", "fleet_document"),
    ("diagnosis_folder", "design_folder", "fleet_folder"),
    ("output_folder",),
    ("repetition",),
    ("side_by_side",),
    ("cli",),
    ("__init__", "__main__"),
)
"""Bottom first. A module or folder imports from rows below its own, and a folder from within itself."""

RANK = {name: rank for rank, row in enumerate(LAYERS) for name in row}

CONFINED: dict[str, tuple[str, ...]] = {
    "h5py": ("recording/hdf5.py", "recording/matlab_hdf5.py"),
    "yaml": ("problem_file/", "recording/import_map.py"),
    "pydantic": ("problem_file/",),
    "pydantic_core": ("problem_file/",),
    "matplotlib": ("plots/",),
    "plotly": ("report/",),
    "jinja2": ("report/",),
    "markupsafe": ("report/",),
    "rich": ("progress_bar.py",),
    "argparse": ("cli/",),
    "distributed": ("execution/cluster.py",),
    "sqlite3": ("fleet/store.py",),
    "pint": ("quantities.py",),
}
"""Libraries, and the files or folders that may import them."""

VAGUE = {"utils", "util", "common", "base", "core", "helpers", "helper", "misc"}


@dataclass(frozen=True)
class Source:
    """One module of the package."""

    place: str
    """Path in the package, such as drive/parts.py."""
    tree: ast.Module

    @property
    def layer(self) -> str:
        return Path(self.place).parts[0].removesuffix(".py")

    @property
    def module(self) -> str:
        parts = ["friction_ocp", *Path(self.place).with_suffix("").parts]
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    def imports(self, whenever: bool = True) -> Iterator[str]:
        """Yield the dotted names that it imports; without `whenever` only those that are imported as it loads."""
        for node in ast.walk(self.tree) if whenever else _loaded(self.tree.body):
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{self.place}: relative import in line {node.lineno}"
                yield node.module or ""
                yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _loaded(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    for node in body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        yield node
        if isinstance(node, (ast.If, ast.Try)):
            yield from _loaded(node.body)


SOURCES = [
    Source(path.relative_to(PACKAGE).as_posix(), ast.parse(path.read_text(encoding="utf-8")))
    for path in sorted(PACKAGE.rglob("*.py"))
]


def test_every_module_has_a_place_in_the_layers() -> None:
    """A new module or folder is put into the table above before it is imported anywhere."""
    assert {source.layer for source in SOURCES} <= RANK.keys()


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.place)
def test_imports_go_only_downwards(source: Source) -> None:
    """A module imports from layers below its own and from its own folder, inside functions too."""
    for name in source.imports():
        if name.startswith("friction_ocp."):
            other = name.split(".")[1]
            lower = RANK.get(other, -1) < RANK[source.layer]
            assert lower or other == source.layer, f"{source.place} imports {name}"


def test_no_module_imports_itself_in_a_circle() -> None:
    """Inside a layer too there is an order: modules can be loaded one after another."""
    known = {source.module for source in SOURCES}
    graph = {
        source.module: {name for name in source.imports(whenever=False) if name in known and name != source.module}
        for source in SOURCES
    }
    assert len(list(TopologicalSorter(graph).static_order())) == len(known)


@pytest.mark.parametrize("library", CONFINED)
def test_a_library_is_imported_only_where_it_belongs(library: str) -> None:
    """Formats, figures and frameworks are each known to one place of the package."""
    users = {source.place for source in SOURCES if any(name.split(".")[0] == library for name in source.imports())}
    assert users
    assert [place for place in users if not place.startswith(CONFINED[library])] == []


def test_only_the_command_line_prints() -> None:
    """`print` is called in cli/ and progress_bar.py and nowhere else."""
    printing = {
        source.place
        for source in SOURCES
        for node in ast.walk(source.tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print"
    }
    assert {place for place in printing if not place.startswith("cli/")} <= {"progress_bar.py"}


def test_no_module_has_a_vague_name() -> None:
    """The name of a module says what belongs into it."""
    names = {part.removesuffix(".py") for source in SOURCES for part in Path(source.place).parts}
    assert names.isdisjoint(VAGUE)

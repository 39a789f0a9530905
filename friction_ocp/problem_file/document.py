"""YAML text to plain values and back: no code, no repeated keys, no exploding aliases, floats as people write them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.import_map import children, mapping_nodes, repeated_keys

MAX_BYTES = 5_000_000
MAX_NODES = 200_000
_NULL, _BOOL, _NUMBER, _MERGE, _TEXT = (
    f"tag:yaml.org,2002:{name}" for name in ("null", "bool", "float", "merge", "str")
)


@dataclass(frozen=True)
class Document:
    """A YAML file as read: its mapping, and the comment at its head."""

    path: Path
    content: Mapping[str, Any]
    head: str
    """The comment lines before the first key, without their `#`."""
    text: str = ""


class _Loader(yaml.SafeLoader):
    """YAML 1.2 scalars: `1e5` is a number; `yes`, `on`, `010` and `12:30` are not what YAML 1.1 made of them."""


class _Dumper(yaml.SafeDumper):
    """Writes no anchors."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


_PATTERNS = (
    (_BOOL, r"true|True|TRUE|false|False|FALSE", "tTfF"),
    (
        _NUMBER,
        r"[-+]?(?:\.\d+|\d+(?:\.\d*)?)(?:[eE][-+]?\d+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)",
        "-+.0123456789",
    ),
    (_NULL, r"~|null|Null|NULL|", "~nN"),
    (_MERGE, r"<<", "<"),
)
_loading: Any = _Loader
_dumping: Any = _Dumper
_loading.yaml_implicit_resolvers = {}
for _tag, _pattern, _first in _PATTERNS:
    for _class in (_loading, _dumping):
        _class.add_implicit_resolver(_tag, re.compile(rf"^(?:{_pattern})$"), [*_first, ""])


def _construct_number(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int | float:
    text = loader.construct_scalar(node)
    if re.fullmatch(r"[-+]?\d{1,18}", text):
        return int(text)
    return float(re.sub(r"\.(?=inf|nan)", "", text.lower()))


_Loader.add_constructor(_NUMBER, _construct_number)


def read_document(path: Path, text: str | None = None) -> Document:
    """Read a YAML mapping, from a file or as if `text` stood there; raises FrictionOcpError with every fault."""
    where = str(path)
    text = _read_text(path) if text is None else text
    try:
        loader: Any = _Loader(text)
        node = loader.get_single_node()
        if not isinstance(node, yaml.MappingNode):
            raise FrictionOcpError(Finding(where, "this is not a problem file", "a mapping with the key format"))
        _refuse_explosion(node, where)
        if findings := _faulty_keys(node, where):
            raise FrictionOcpError(findings)
        content: Any = loader.construct_document(node)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}" if mark else "somewhere"
        raise FrictionOcpError(Finding(where, f"this is not YAML: {place}: {error.problem}")) from error
    except yaml.YAMLError as error:
        raise FrictionOcpError(Finding(where, f"this is not YAML: {' '.join(str(error).split())}")) from error
    except RecursionError as error:
        raise FrictionOcpError(Finding(where, "this is nested too deeply")) from error
    except (ValueError, KeyError, AttributeError, OverflowError) as error:
        what = "a value is not what its tag says, or no possible date"
        raise FrictionOcpError(Finding(where, what, remedy="leave tags out, or quote the value")) from error
    return Document(path, content, head_comment(text), text)


def dump_document(content: Mapping[str, Any], head: str = "") -> str:
    """Return the text of a YAML file: the comment at its head, then its keys in their order."""
    comment = "".join(f"# {line}".rstrip() + "\n" for line in head.splitlines())
    body = yaml.dump(
        dict(content), Dumper=_Dumper, sort_keys=False, default_flow_style=None, allow_unicode=True, width=120
    )
    return f"{comment}\n{body}" if comment else body


def head_comment(text: str) -> str:
    """Return the comment lines before the first key, without their `#`."""
    lines: list[str] = []
    for line in text.lstrip("\ufeff").splitlines():
        stripped = line.strip()
        if stripped and not stripped.startswith("#"):
            break
        if stripped:
            lines.append(stripped[1:].removeprefix(" "))
    return "\n".join(lines)


def _read_text(path: Path) -> str:
    where = str(path)
    try:
        if path.stat().st_size > MAX_BYTES:
            raise FrictionOcpError(Finding(where, "the file is too large", f"at most {MAX_BYTES} bytes"))
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise FrictionOcpError(Finding(where, "there is no such file", remedy="correct the path")) from error
    except IsADirectoryError as error:
        raise FrictionOcpError(Finding(where, "this is a folder", "a problem file, such as axis.yaml")) from error
    except (OSError, UnicodeDecodeError) as error:
        what = f"the file cannot be read as text ({error})"
        raise FrictionOcpError(Finding(where, what, "a YAML file in UTF-8")) from error


def _refuse_explosion(root: yaml.Node, where: str) -> None:
    """Count the nodes that the aliases stand for, without making them."""
    sizes: dict[int, int] = {}
    under_way: set[int] = set()

    def size(node: yaml.Node) -> int:
        if id(node) in under_way:
            raise FrictionOcpError(Finding(where, "an alias contains itself", remedy="write its content out"))
        if id(node) not in sizes:
            under_way.add(id(node))
            sizes[id(node)] = 1 + sum(size(child) for child in children(node))
            under_way.discard(id(node))
        return sizes[id(node)]

    if size(root) > MAX_NODES:
        what = f"its aliases stand for {size(root)} values"
        raise FrictionOcpError(Finding(where, what, f"at most {MAX_NODES}", "write the content out"))


def _faulty_keys(root: yaml.Node, where: str) -> list[Finding]:
    """Find keys that stand twice in a mapping, or that are not text; keys that look like numbers become text."""
    return [item for node in mapping_nodes(root) for item in _faults_of_mapping(node, where)]


def _faults_of_mapping(node: yaml.MappingNode, where: str) -> list[Finding]:
    findings: list[Finding] = []
    names: list[yaml.Node] = []
    for key, _ in node.value:
        if not isinstance(key, yaml.ScalarNode):
            line = key.start_mark.line + 1
            findings.append(Finding(f"{where}: line {line}", "a key is a list or a mapping", "keys are names"))
            continue
        if key.tag != _MERGE:
            key.tag = _TEXT
        names.append(key)
    return findings + repeated_keys(names, where)

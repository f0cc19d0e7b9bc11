"""YAML as its reader expects it: the core schema of YAML 1.2, no key twice, nothing but plain data.

PyYAML follows YAML 1.1, where 58.0e9 and 1e-3 are strings, 010 is eight, 1:30 is ninety and `no` is a boolean; all but
the first of a repeated key's values vanish without a word. Here only the parser is PyYAML's. What its nodes mean is
decided below, with the key path at hand for the message.
"""

from __future__ import annotations

import os
import re
from typing import TypeAlias

import yaml

from ctr_pvs.errors import RobotFileError

Plain: TypeAlias = "dict[object, Plain] | list[Plain] | str | int | float | bool | None"

LARGEST_FILE = 1_000_000  # bytes; a robot file has a few hundred

_TAG = "tag:yaml.org,2002:"
_SPECIAL_FLOAT = re.compile(r"([-+]?)\.(inf|nan)", re.IGNORECASE)  # Python writes these without the dot


class _CoreSchemaLoader(yaml.SafeLoader):
    """A parser that tells YAML 1.2's plain scalars apart."""


_CoreSchemaLoader.yaml_implicit_resolvers = {}  # none of YAML 1.1's
for _kind, _pattern, _first_characters in (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", list("-+0123456789")),
    (
        "float",
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        list("-+.0123456789"),
    ),
):
    _CoreSchemaLoader.add_implicit_resolver(_TAG + _kind, re.compile(rf"^(?:{_pattern})$"), _first_characters)


def read_yaml(path: str | os.PathLike[str]) -> Plain:
    """The one document in the file at `path`.

    Raises:
        RobotFileError: when there is no such file, or it is not UTF-8, not YAML, repeats a key, or holds anything but
            mappings, lists, text, numbers, booleans and nulls.
    """
    file = os.fspath(path)
    text = read_text(file, "a robot file")
    try:
        node = yaml.compose(text, Loader=_CoreSchemaLoader)
        return None if node is None else _Reading(file).plain(node, "")
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f" in line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise RobotFileError(file, "", f"{error.problem or error.context}{where}", "valid YAML") from None
    except yaml.YAMLError as error:
        raise RobotFileError(file, "", str(error), "valid YAML") from None
    except RecursionError:
        raise RobotFileError(file, "", "hundreds of levels of nesting", "a robot file") from None


def read_text(file: str, rule: str) -> str:
    """The text of a file; `rule` is what an error says was expected.

    Raises:
        RobotFileError: when there is no such file, it is larger than ``LARGEST_FILE``, or it is not UTF-8.
    """
    try:
        with open(file, "rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:  # ValueError: a path that holds a null character
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise RobotFileError(file, "", reason, rule, "check the path") from None
    if len(content) > LARGEST_FILE:
        raise RobotFileError(file, "", "a larger file", f"{rule} of at most {LARGEST_FILE} bytes")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        byte = f"byte 0x{content[error.start]:02x} at offset {error.start}"
        raise RobotFileError(file, "", byte, "UTF-8 text", "save the file as UTF-8") from None


class _Reading:
    """Turns the nodes of one file into plain data."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._done: dict[int, Plain] = {}  # by id of the node, so that aliases of aliases do not multiply
        self._open: set[int] = set()  # nodes being read, to notice an alias inside what it stands for

    def plain(self, node: yaml.Node, path: str) -> Plain:
        key = id(node)
        if key in self._done:
            return self._done[key]
        if key in self._open:
            raise RobotFileError(self._file, path, "an alias that contains itself", "a finite value")
        self._open.add(key)
        if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
            value: Plain = self._mapping(node, path)
        elif isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            value = [self.plain(item, f"{path}[{index}]") for index, item in enumerate(node.value)]
        else:
            value = self._scalar(node, path)
        self._open.remove(key)
        self._done[key] = value
        return value

    def _mapping(self, node: yaml.MappingNode, path: str) -> Plain:
        mapping: dict[object, Plain] = {}
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            key = self.plain(key_node, path)
            if isinstance(key, dict | list):
                raise RobotFileError(self._file, path, key, "text as a key", f"see line {line}")
            here = f"{path}.{key}" if path else str(key)
            if key in mapping:
                raise RobotFileError(self._file, here, key, "every key once", f"remove the one in line {line}")
            mapping[key] = self.plain(value_node, here)
        return mapping

    def _scalar(self, node: yaml.Node, path: str) -> Plain:
        kind, text = node.tag.removeprefix(_TAG), node.value
        try:
            if kind == "str":
                return text
            if kind == "null":
                return None
            if kind == "bool":
                return {"true": True, "false": False}[text.lower()]
            if kind == "int":
                return int(text, 0 if text[1:2] in ("o", "x") else 10)
            if kind == "float":
                return float(_SPECIAL_FLOAT.sub(r"\1\2", text))
        except (KeyError, ValueError):  # an explicit tag on other text, or thousands of digits
            raise RobotFileError(self._file, path, text, f"text that can be read as {kind}") from None
        raise RobotFileError(self._file, path, node.tag, "plain YAML without tags", "remove the tag")

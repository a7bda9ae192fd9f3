"""ROS 2 parameter files, read as rcl reads them but strictly: duplicates and unknown nodes are errors with a place.

rcl itself accepts unknown node names, unknown keys and duplicate keys without a word. Its plain scalars are those of
``_PLAIN``: ``6e-1`` is a number, ``y`` is true, ``017`` is 15, ``~`` is text; PyYAML alone reads all four otherwise.
"""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import yaml

from quad_core.cascade import ALL_ROLES
from quad_core.parameters import ParameterError, Value

LONGEST = 1 << 20  # characters of YAML; a flight's parameters are some 30,000
DEEPEST = 40  # levels of YAML
# libyaml's are four times as fast, and every node of a flight reads and writes its parameters
SafeLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_SafeDumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
ODD_INDENT = re.compile(r"^[ \t]*([^\S \t\r\n]|\u200b)", re.MULTILINE)
_NO_SUCH = re.compile("unknown parameter|no such parameter")
_TRUE = ("y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON")
_FALSE = ("n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF")
_PLAIN = {
    "bool": "|".join((*_TRUE, *_FALSE)),
    "int": "[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)",
    "float": r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.?(inf|Inf|INF)|\.?(nan|NaN|NAN)",
    "null": "",
}
"""{type: the plain scalars of it}, in the order in which rcl tries them; every other scalar is text."""


_DUMPED = "start_type_description_service"
_OF_ROS = ("use_sim_time", _DUMPED)


def is_of_ros(name: str) -> bool:
    """Return whether every node of rclpy has the parameter ``name``: files may set it, and no node of ours reads it."""
    return name in _OF_ROS or name.startswith("qos_overrides.")


class StrictLoader(SafeLoader):  # type: ignore[misc]  # of libyaml, untyped
    """SafeLoader that reads plain scalars as rcl does and refuses duplicate keys."""

    yaml_implicit_resolvers: ClassVar[dict[str, Any]] = {}


for _tag, _pattern in _PLAIN.items():
    StrictLoader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(f"^(?:{_pattern})$"), None)


def _number(_: StrictLoader, node: yaml.ScalarNode) -> int:
    text = node.value.lower()
    base = 16 if "0x" in text else 8 if text.lstrip("+-").startswith("0") else 10
    return int(text, base)


def _real(_: StrictLoader, node: yaml.ScalarNode) -> float:
    text = node.value.lower()
    return float(text.replace(".", "") if text.endswith(("inf", "nan")) else text)


StrictLoader.add_constructor("tag:yaml.org,2002:bool", lambda _, node: node.value in _TRUE)
StrictLoader.add_constructor("tag:yaml.org,2002:int", _number)
StrictLoader.add_constructor("tag:yaml.org,2002:float", _real)


def _mapping(loader: StrictLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    seen: dict[Any, Any] = {}
    for key_node, value_node in node.value:
        # a name, also where it looks like a number or the bool y
        key = key_node.value if isinstance(key_node, yaml.ScalarNode) else loader.construct_object(key_node, deep=True)
        if key in seen:
            raise ParameterError(f"line {key_node.start_mark.line + 1}: key {key!r} is given twice")
        seen[key] = loader.construct_object(value_node, deep=True)
    return seen


StrictLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping)


def plain_value(text: str) -> Value:
    """Return the value of a plain scalar as in a file, of an empty text or any other the text itself."""
    loader = StrictLoader("")
    tag = loader.resolve(yaml.ScalarNode, text, (True, False))
    return loader.construct_object(yaml.ScalarNode(tag, text)) if text else text


def dump_yaml(content: Any, *, sort_keys: bool = False) -> str:
    """Return ``content``, made of plain Python values, as YAML; raises yaml.YAMLError for anything else."""
    return str(yaml.dump(content, Dumper=_SafeDumper, sort_keys=sort_keys))


def load_yaml(text: str, loader: Any = SafeLoader) -> Any:
    """Return what ``text`` says. Raises ValueError if it is too long or deep, holds an alias, or is no YAML.

    ``loader``: SafeLoader, or a subclass that refuses more.
    """
    if len(text) > LONGEST:
        raise ValueError(f"{len(text)} characters of YAML, more than the {LONGEST} that are read")
    if indent := ODD_INDENT.search(text):
        line, found = text.count("\n", 0, indent.start()) + 1, f"U+{ord(indent[1]):04X}"
        raise ValueError(f"line {line}: found the blank {found}, expected U+0020: YAML is indented by plain blanks")
    try:
        _check_events(text)
        return yaml.load(text, loader)
    except RecursionError as error:
        raise ValueError("YAML too deep to be read") from error
    except (yaml.YAMLError, ValueError, TypeError, OverflowError, AttributeError, KeyError) as error:
        mark = getattr(error, "problem_mark", None)
        if mark is not None and "\t" in "".join(text.split("\n")[mark.line : mark.line + 1])[: mark.column + 1]:
            raise ValueError(f"line {mark.line + 1}: found a tab, expected blanks, as YAML demands") from error
        # the constructors of dates, numbers, keys and merges raise whatever Python does
        raise ValueError(" ".join(str(error).split())[:300]) from error


def load_yaml_file(path: Path, loader: Any = SafeLoader) -> Any:
    """Return what the file ``path`` says, as ``load_yaml``; raises OSError, and ValueError for another encoding too."""
    data = path.read_bytes()
    if data[:2] in (b"\xff\xfe", b"\xfe\xff") or 0 in data[:2]:
        found = "UTF-32" if data[:8].count(0) > 4 else "UTF-16"
        raise ValueError(f"found {found}, expected UTF-8: save the file as UTF-8")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        found = f"found the byte 0x{data[error.start]:02x}, as Latin-1 has it, expected UTF-8"
        raise ValueError(f"line {line}: {found}: save the file as UTF-8") from error
    return load_yaml(text, loader)


def read_parameter_file(path: Path) -> dict[str, dict[str, Value]]:
    """Return {node pattern: {dotted name: value}} of a ROS 2 parameter file.

    Raises ParameterError naming file and line or key: not readable, broken YAML, duplicate keys, an unknown
    of ours, or a section without ``ros__parameters``.
    """
    try:
        content = load_yaml_file(path, StrictLoader)
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise ParameterError(f"{path}: {error}") from error
    return _by_section(content, str(path))


def read_parameter_text(text: str, where: str) -> dict[str, dict[str, Value]]:
    """Return the content of a parameter file as ``read_parameter_file`` does; ``where`` names it in errors."""
    try:
        content = load_yaml(text, StrictLoader)
    except ValueError as error:
        raise ParameterError(f"{where}: {error}") from error
    return _by_section(content, where)


def _by_section(content: Any, where: str) -> dict[str, dict[str, Value]]:
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise ParameterError(f"{where}: found {type(content).__name__}, expected node names with ros__parameters")
    found: dict[str, dict[str, Value]] = {}
    for pattern, body in _sections(content, ""):
        if pattern in found:
            raise ParameterError(f"{where}: {pattern} is given twice")
        found[pattern] = _section(where, pattern, body)
    return found


def overrides_for(files: list[dict[str, dict[str, Value]]], role: str, namespace: str = "/") -> dict[str, Value]:
    """Return the values that ``files`` hold for the node ``role`` in ``namespace``, as rclpy has them.

    A later file wins within a section; of two sections the one that first appears later, named or with wildcards.
    """
    sections: dict[str, dict[str, Value]] = {}
    for content in files:
        for pattern, values in content.items():
            sections.setdefault(pattern, {}).update(values)
    merged: dict[str, Value] = {}
    for pattern, values in sections.items():
        if reaches(pattern, role, namespace):
            merged.update(values)
    return merged


def reaches(pattern: str, role: str, namespace: str = "/") -> bool:
    """Return whether the section ``pattern`` of a file is for the node ``role`` in ``namespace``, as rclpy has it.

    ``/*`` stands for one name, ``/**`` for any number of them; a pattern without a leading slash gets one.
    """
    parts = [part for part in pattern.split("/") if part]
    each = {"*": r"/\w+", "**": r"(?:/\w+)*"}
    expression = "".join(each.get(part, "/" + re.escape(part)) for part in parts)
    return re.fullmatch(expression, f"/{namespace.strip('/')}/{role}".replace("//", "/")) is not None


def check_reached(path: Path, roles: Collection[str], namespace: str = "/") -> None:
    """Raise ParameterError for a section of the parameter file ``path`` that reaches none of the nodes ``roles``."""
    for pattern in read_parameter_file(path):
        if any(reaches(pattern, role, namespace) for role in roles):
            continue
        role = pattern.rsplit("/", 1)[-1]
        where = f"/{namespace.strip('/')}/".replace("//", "/")
        if role in roles:
            why = f"the nodes of this flight are in {where}: expected {where}{role} or /**/{role}"
        else:
            why = f"expected one of its nodes: {', '.join(roles)}"
        raise ParameterError(f"{path}: section {pattern} reaches no node of this flight; {why}")


def place_of(problem: str, files: Sequence[Path], role: str = "") -> str:
    """Return ``FILE: `` of the last of ``files`` that holds what ``problem`` complains of, empty if none does.

    ``problem`` begins with the name of a parameter and shows its value, or says that there is no such parameter.
    ``role``: only what is set for this node counts; empty: for any.
    """
    name, _, complaint = problem.partition(":")
    for path in reversed(files):
        for pattern, values in read_parameter_file(path).items():
            ours = not role or pattern.rsplit("/", 1)[-1] in (role, "*", "**")
            if ours and name in values and (repr(values[name]) in complaint or _NO_SUCH.search(complaint)):
                return f"{path}: "
    return ""


def _sections(content: Mapping[Any, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield each node pattern and what stands under it; rcl accepts namespaces as keys around it."""
    for name, body in content.items():
        pattern = f"{prefix}{name}"
        if isinstance(body, dict) and body and "ros__parameters" not in body:
            yield from _sections(body, f"{pattern.rstrip('/')}/")
        else:
            yield pattern, body


def _section(path: str, pattern: str, body: Any) -> dict[str, Value]:
    if not isinstance(body, dict) or set(body) != {"ros__parameters"}:
        raise ParameterError(f"{path}: {pattern}: expected one key ros__parameters")
    if pattern.rsplit("/", 1)[-1] not in (*ALL_ROLES, "*", "**"):
        raise ParameterError(f"{path}: node {pattern!r} is not one of {', '.join(ALL_ROLES)} or /**")
    values = _dotted(path, pattern, body["ros__parameters"] or {}, "")
    if _DUMPED not in values:
        return values
    # what `ros2 param dump` wrote: which flight the node was in is no choice for another one
    return {name: value for name, value in values.items() if not name.startswith("flight.")}


def _dotted(path: str, pattern: str, values: Any, prefix: str) -> dict[str, Value]:
    if not isinstance(values, Mapping):
        raise ParameterError(f"{path}: {pattern}: {prefix or 'ros__parameters'}: expected names with values")
    flat: dict[str, Value] = {}
    for name, value in values.items():
        inner = (
            _dotted(path, pattern, value, f"{prefix}{name}.")
            if isinstance(value, Mapping)
            else {prefix + str(name): value}
        )
        if value is None:
            raise ParameterError(f"{path}: {pattern}: {prefix}{name}: found no value, expected one")
        double = next((key for key in inner if key in flat), None)
        if double:
            raise ParameterError(f"{path}: {pattern}: {double} is given twice")
        flat.update(inner)
    return flat


def _check_events(text: str) -> None:
    depth = 0
    for event in yaml.parse(text, SafeLoader):
        if isinstance(event, yaml.AliasEvent):
            raise ValueError(f"alias *{event.anchor}: not read, a few of them can stand for terabytes")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise ValueError(f"nested more than {DEEPEST} deep")

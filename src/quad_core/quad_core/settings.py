"""``--set NODE.PARAM=VALUE`` of every command line: from text to typed overrides."""

from collections.abc import Mapping, Sequence

from quad_core.node_parameters import ALL_ROLES, resolve
from quad_core.parameters import Field, Flag, ParameterError, Real, Value, Whole

SHARED = ("flight", "vehicle")


def parse_settings(settings: Sequence[str]) -> dict[str, dict[str, str]]:
    """Return {role or "/**": {parameter: text}} of NODE.PARAM=VALUE; NODE `flight` and `vehicle` mean all nodes.

    Raises ParameterError for another form or an unknown node.
    """
    found: dict[str, dict[str, str]] = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        node, dot, parameter = name.partition(".")
        if not (equals and dot and parameter):
            raise ParameterError(f"--set {setting}: expected NODE.PARAM=VALUE")
        if node in SHARED:
            node, parameter = "/**", name
        elif node not in ALL_ROLES:
            known = ", ".join((*ALL_ROLES, *SHARED))
            raise ParameterError(f"--set {setting}: no node {node!r}; expected one of {known}")
        found.setdefault(node, {})[parameter] = value
    return found


def with_law(values: Mapping[str, Value], law: str) -> dict[str, Value]:
    """Return the parameters of a controller with another law: it starts from its defaults, all else stays."""
    before = values.get("law")
    if law == before:
        return dict(values)
    kept = {name: value for name, value in values.items() if before is None or not name.startswith(f"{before}.")}
    return {**kept, "law": law, "preset": "tuned"}


def typed(role: str, base: Mapping[str, Value], texts: Mapping[str, str]) -> dict[str, Value]:
    """Return ``texts`` as the types of the node's parameters; the choice of plug-ins among them decides which."""
    slots = {*ALL_ROLES[role].slots, "preset"}
    chosen = {name: text for name, text in texts.items() if name in slots}
    known = {field.name: field for field in resolve(role, {**base, **chosen}).all_fields()}
    return {name: _value(known.get(name), text) for name, text in texts.items()}


def _value(field: Field | None, text: str) -> Value:
    if field is None:
        return text
    try:
        if isinstance(field.spec, Real):
            return float(text)
        if isinstance(field.spec, Whole):
            return int(text)
    except ValueError:
        return text
    if isinstance(field.spec, Flag):
        return {"true": True, "false": False}.get(text.lower(), text)
    return text

"""YAML, by libyaml where PyYAML has it: what a stranger may have written is read within bounds.

Every defect is one ``ValueError`` of one line.
"""

from typing import Any

import yaml

LONGEST = 1 << 20  # characters; a flight's parameters are some 30,000
DEEPEST = 40  # levels
# libyaml's are four times as fast, and every node of a flight reads and writes its parameters
SafeLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_SafeDumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


def dump_yaml(content: Any, *, sort_keys: bool = False) -> str:
    """Return ``content``, made of plain Python values, as YAML; raises yaml.YAMLError for anything else."""
    return str(yaml.dump(content, Dumper=_SafeDumper, sort_keys=sort_keys))


def load_yaml(text: str, loader: Any = SafeLoader) -> Any:
    """Return what ``text`` says. Raises ValueError if it is too long or deep, holds an alias, or is no YAML.

    ``loader``: SafeLoader, or a subclass that refuses more.
    """
    if len(text) > LONGEST:
        raise ValueError(f"{len(text)} characters of YAML, more than the {LONGEST} that are read")
    try:
        _check_events(text)
        return yaml.load(text, loader)
    except RecursionError as error:
        raise ValueError("YAML too deep to be read") from error
    except (yaml.YAMLError, ValueError, TypeError, OverflowError, AttributeError, KeyError) as error:
        # the constructors of dates, numbers, keys and merges raise whatever Python does
        raise ValueError(" ".join(str(error).split())[:300]) from error


def _check_events(text: str) -> None:
    depth = 0
    for event in yaml.parse(text, SafeLoader):
        if isinstance(event, yaml.AliasEvent):
            raise ValueError(f"alias *{event.anchor}: not read, a few of them can stand for terabytes")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise ValueError(f"nested more than {DEEPEST} deep")

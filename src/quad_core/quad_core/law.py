"""A law as a stage runs it: a plug-in's module, or one within the wrappers of ``quad_core.cascade.WRAPPERS``."""

from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple


class Law(NamedTuple):
    """The types and functions of a law, named as in a plug-in's module; ``name``: what it is called in messages."""

    name: str
    Parameters: type[Any]
    Memory: type[Any]
    Internals: type[Any]
    init: Callable[..., Any]
    step: Callable[..., Any]


class Wrapper(NamedTuple):
    """What a stage puts around its law: ``wrapped(law, inputs_type)`` gives the law with it.

    ``switch``: the parameter of the stage's node with a field ``enabled``, empty: always on. The wrapped law's
    ``Parameters`` are then (those of the law, that parameter).
    """

    wrapped: Callable[..., Law]
    switch: str = ""


def law_of(module: ModuleType) -> Law:
    """Return the law that a plug-in's module is."""
    return Law(module.__name__, module.Parameters, module.Memory, module.Internals, module.init, module.step)

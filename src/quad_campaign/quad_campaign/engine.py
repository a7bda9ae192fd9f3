"""The loop bound to plug-ins: plain Python, or compiled by Numba with a cache that knows its sources."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

from quad_campaign import loop, packing
from quad_campaign.stages import Modules
from quad_core import compilation, sources
from quad_core.compilation import compiled


class EngineError(RuntimeError):
    """A flight cannot be flown compiled; the text names the plug-in and what Numba said."""


class Engine(NamedTuple):
    """The two functions of ``loop``, bound to plug-ins."""

    take_off: Any
    fly: Any


@cache
def python_engine(modules: Modules) -> Engine:
    """Return the loop as plain Python."""
    return Engine(_link(loop.take_off, modules), _link(loop.fly, modules))


@cache
def compiled_engine(modules: Modules) -> Engine:
    """Return the loop compiled by Numba; compiled once per state of the sources, kept in the user's cache."""
    plain = python_engine(modules)
    directory = sources.cache_root() / source_hash(modules)
    return Engine(_cached(compiled(plain.take_off), directory), _cached(compiled(plain.fly), directory))


@cache
def compiled_logger(modules: Modules, kinds: tuple[type[Any], ...]) -> Any:
    """Return ``packing.fly_packed`` bound to plug-ins; ``kinds``: what the fields of ``loop.Records`` are lists of."""
    scope = {**packing.fly_packed.__globals__, "fly": python_engine(modules).fly}
    for name, kind in zip(loop.Records._fields, kinds, strict=True):
        scope[f"pack_{name}"] = packing.packer(kind)  # type: ignore[arg-type]
    twin = _twin(packing.fly_packed, scope)
    return _cached(compiled(twin), sources.cache_root() / source_hash(modules))


def source_hash(modules: Modules) -> str:
    """Return a hash over the stages and over every source file that the bound loop reaches, plug-ins included."""
    names = " ".join(
        f"{name} {function.__module__}.{function.__qualname__}" for name, function in modules.functions().items()
    )
    return sources.source_hash(python_engine(modules), (Path(packing.__file__), Path(compilation.__file__)), names)


def explain(modules: Modules, error: Exception) -> EngineError:
    """Return an error that names the plug-ins which ``error``, raised by Numba, is about."""
    names = ", ".join(module.__name__ for module in modules)
    return EngineError(f"cannot be compiled ({names}): {' '.join(str(error).split())[:600]}")


def _link(function: Callable[..., Any], modules: Modules) -> FunctionType:
    return _twin(function, {**function.__globals__, **modules.functions()})


def _twin(function: Callable[..., Any], scope: dict[str, Any]) -> FunctionType:
    assert isinstance(function, FunctionType)
    twin = FunctionType(function.__code__, scope, function.__name__)
    twin.__module__ = function.__module__
    twin.__qualname__ = function.__qualname__
    return twin


def _cached(dispatcher: Any, directory: Path) -> Any:
    import numba

    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(directory)
    try:
        dispatcher.enable_caching()
    finally:
        numba.config.CACHE_DIR = before
    return dispatcher

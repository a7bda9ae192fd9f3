"""The loop bound to plug-ins: plain Python, or compiled by Numba with a cache that knows its sources."""

import hashlib
import inspect
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

from quad_campaign import loop, packing
from quad_campaign.stages import Modules
from quad_core import compilation
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
    directory = cache_root() / source_hash(modules)
    return Engine(_cached(compiled(plain.take_off), directory), _cached(compiled(plain.fly), directory))


@cache
def compiled_logger(modules: Modules, kinds: tuple[type[Any], ...]) -> Any:
    """Return ``packing.fly_packed`` bound to plug-ins; ``kinds``: what the fields of ``loop.Records`` are lists of."""
    scope = {**packing.fly_packed.__globals__, "fly": python_engine(modules).fly}
    for name, kind in zip(loop.Records._fields, kinds, strict=True):
        scope[f"pack_{name}"] = packing.packer(kind)  # type: ignore[arg-type]
    twin = _twin(packing.fly_packed, scope)
    return _cached(compiled(twin), cache_root() / source_hash(modules))


def cache_root() -> Path:
    """Return the folder that holds compiled loops: QUAD_CACHE_DIR, else quad_campaign in the user's cache."""
    chosen = os.environ.get("QUAD_CACHE_DIR")
    return Path(chosen) if chosen else Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "quad_campaign"


def source_hash(modules: Modules) -> str:
    """Return a hash over the stages and over every source file that the bound loop reaches, plug-ins included.

    Numba itself looks only at the file of the function that it caches.
    """
    import numba

    digest = hashlib.sha256(f"{sys.version} {numba.__version__}".encode())
    for name, function in modules.functions().items():
        digest.update(f"{name} {function.__module__}.{function.__qualname__}\n".encode())
    files: set[Path] = set()
    seen: set[FunctionType] = set()
    for entry in python_engine(modules):
        _reach(entry, seen, files)
    files.update((Path(packing.__file__), Path(compilation.__file__)))
    for path in sorted(files):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


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


def _reach(function: FunctionType, seen: set[FunctionType], files: set[Path]) -> None:
    if function in seen:
        return
    seen.add(function)
    files.add(Path(inspect.getfile(function.__code__)))
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        if isinstance(value, FunctionType):
            _reach(value, seen, files)
        elif isinstance(value, type) and value.__module__ in sys.modules and hasattr(value, "_fields"):
            files.add(Path(inspect.getfile(value)))


def _cached(dispatcher: Any, directory: Path) -> Any:
    import numba

    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(directory)
    try:
        dispatcher.enable_caching()
    finally:
        numba.config.CACHE_DIR = before
    return dispatcher

"""Which source files a pure function is made of, and where what was compiled from them is kept."""

import hashlib
import inspect
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from enum import IntEnum
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import FunctionType
from typing import Any

from quad_core.ownership import private_folder


def cache_root() -> Path:
    """Return the folder that holds compiled code: QUAD_CACHE_DIR, else quad_campaign in the user's cache.

    It is made if it lacks. What lies there is run: a folder that others may change raises NotOursError, one that cannot
    be made another OSError.
    """
    chosen = os.environ.get("QUAD_CACHE_DIR")
    return private_folder(Path(chosen) if chosen else _user_cache() / "quad_campaign")


def _user_cache() -> Path:
    """Return XDG_CACHE_HOME, which is to be ignored where it is empty or not absolute, else ~/.cache."""
    chosen = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return chosen if chosen.is_absolute() else Path.home() / ".cache"


def source_hash(functions: Iterable[Callable[..., Any]], more: Iterable[Path], text: str) -> str:
    """Return a hash over Python, Numba, ``text`` and every file that holds ``functions`` or what they reach.

    Numba itself looks only at the file of the function that it caches.
    """
    try:
        numba = version("numba")
    except PackageNotFoundError:
        numba = "none"
    digest = hashlib.sha256(f"{sys.version} {numba} {text}\n".encode())
    files: set[Path] = set(more)
    seen: set[FunctionType] = set()
    for function in functions:
        if isinstance(function, FunctionType):
            for line in _reach(function, seen, files):
                digest.update(line.encode())
    for path in sorted(files):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _reach(function: FunctionType, seen: set[FunctionType], files: set[Path]) -> Iterator[str]:
    """Add the files of ``function`` and of what it reaches; gives the constants that they read, a line each."""
    if function in seen:
        return
    seen.add(function)
    files.add(Path(inspect.getfile(function.__code__)))
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        if isinstance(value, FunctionType):
            yield from _reach(value, seen, files)
        elif isinstance(value, int | float | tuple):
            yield f"{function.__module__}.{name} = {value!r}\n"
        elif isinstance(value, type) and issubclass(value, IntEnum):
            yield f"{function.__module__}.{name} = {list(value)!r}\n"
        elif isinstance(value, type) and value.__module__ in sys.modules and hasattr(value, "_fields"):
            files.add(Path(inspect.getfile(value)))

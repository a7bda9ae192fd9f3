"""The loop of a flight's plug-ins: plain Python, or compiled by Numba with a cache that knows its sources."""

import hashlib
import inspect
import os
import sys
import time
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path
from threading import Event, Lock, Thread
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

from quad_core import compilation
from quad_core.compilation import compiled
from quad_core.cycle import lag_check
from quad_dynamics.simulated_vehicle import vehicle_functions
from quad_flight import rows, stages
from quad_flight.loop import Functions, fly_of

_ONE_AT_A_TIME = Lock()  # threads that begin together would each make, and compile, an engine
_BEGUN: set[Hashable] = set()
_SIGN_EVERY = 10.0  # s
PLANS = 64  # plans that are kept: flights of a campaign that begin alike with the same trajectory share one


class EngineError(RuntimeError):
    """A flight cannot be flown compiled; the text names the plug-in and what Numba said."""


class Modules(NamedTuple):
    """The plug-in modules of one flight; ``stages``: one per stage of the cascade."""

    plant: ModuleType
    disturbance: ModuleType
    trajectory: ModuleType
    sensing: ModuleType
    stages: Any


class Engine(NamedTuple):
    """What the plug-ins of a flight do, and the loop of them: ``fly`` without log, ``fly_logged`` with."""

    functions: Functions
    fly: Any
    fly_logged: Any


@cache
def python_engine(modules: Modules) -> Engine:
    """Return the loop as plain Python."""
    functions = Functions(
        vehicle_functions(modules.plant, modules.sensing),
        modules.plant.lumped,
        modules.disturbance.sample,
        lru_cache(PLANS)(modules.trajectory.plan),
        modules.trajectory.sample,
        modules.trajectory.duration,
        stages.answer_of(modules.stages),
        lag_check(modules.stages.position_controller.Internals),
    )
    return Engine(functions, fly_of(functions), fly_of(functions, rows.writer(modules.stages)))


def compiled_engine(modules: Modules) -> Engine:
    """Return the loop compiled by Numba; compiled once per state of the sources, kept in the user's cache."""
    with _ONE_AT_A_TIME:
        return _compiled_engine(modules)


@cache
def _compiled_engine(modules: Modules) -> Engine:
    functions, *loops = python_engine(modules)
    loops = [compiled(function) for function in loops]
    try:
        directory = cache_root() / source_hash(modules)
        if not directory.exists():
            names = ", ".join(names_of(modules))
            sys.stderr.write(f"compiling the flight, once for its laws and plant, one or two minutes: {names}\n")
        return Engine(functions, *(_cached(function, directory) for function in loops))
    except (OSError, RuntimeError) as error:
        if isinstance(error, OSError) and error.errno is None:  # a folder that others may change
            raise
        sys.stderr.write(f"compiled code is not kept ({error}): QUAD_CACHE_DIR names a folder that can be written\n")
        return Engine(functions, *loops)


@contextmanager
def signs_of_life(key: Hashable) -> Iterator[None]:
    """Say on stderr how long it has taken, as long as the first of all that is done under ``key`` goes on."""
    if key in _BEGUN:
        yield
        return
    _BEGUN.add(key)
    done, began = Event(), time.monotonic()

    def tell() -> None:
        while not done.wait(_SIGN_EVERY):
            sys.stderr.write(f"\rcompiling the flight: {time.monotonic() - began:.0f} s so far\n")
            sys.stderr.flush()

    Thread(target=tell, daemon=True).start()
    try:
        yield
    finally:
        done.set()


def names_of(modules: Modules) -> list[str]:
    """Return what the plug-ins of a flight are called."""
    return [*(module.__name__ for module in modules[:-1]), *(law.name for law in modules.stages)]


def explain(modules: Modules, error: Exception) -> EngineError:
    """Return an error that names the plug-ins which ``error``, raised by Numba, is about."""
    names = ", ".join(names_of(modules))
    return EngineError(f"cannot be compiled ({names}): {' '.join(str(error).split())[:600]}")


def cache_root() -> Path:
    """Return the folder that holds compiled code: QUAD_CACHE_DIR, else quad_campaign in the user's cache.

    It is made if it lacks. What lies there is run: a folder that others may change raises PermissionError without a
    number, one that cannot be made another OSError. XDG_CACHE_HOME counts only where it is absolute, as its
    specification says.
    """
    user = Path(os.environ.get("XDG_CACHE_HOME", ""))
    user = user if user.is_absolute() else Path.home() / ".cache"
    folder = Path(os.environ.get("QUAD_CACHE_DIR") or user / "quad_campaign").absolute()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    status = folder.stat()
    if status.st_uid not in (os.geteuid(), 0) or status.st_mode & 0o022:
        found = f"mode {status.st_mode & 0o7777:04o}, user {status.st_uid}"
        raise PermissionError(f"{folder}: found {found}, expected a folder that only user {os.geteuid()} writes")
    return folder


def source_hash(modules: Modules) -> str:
    """Return a hash over Python, Numba and all that the bound loop reaches, plug-ins included.

    Numba itself looks only at the file of the function that it caches.
    """
    columns = " ".join(rows.names(modules.stages))
    digest = hashlib.sha256(f"{sys.version} {version('numba')} {columns}\n".encode())
    files = {Path(inspect.getfile(compilation))}
    seen: set[FunctionType] = set()
    for function in (*python_engine(modules)[1:], modules.trajectory.plan, modules.trajectory.duration):
        for line in reached(function, seen, files):
            digest.update(line.encode())
    for path in sorted(files):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def reached(function: FunctionType, seen: set[FunctionType], files: set[Path]) -> Iterator[str]:
    """Yield a line for each function that ``function`` reaches and each constant that one reads; adds their files."""
    if function in seen:
        return
    seen.add(function)
    files.add(Path(inspect.getfile(function.__code__)))
    yield f"{function.__module__}.{function.__qualname__}\n"
    values = [(name, function.__globals__.get(name)) for name in function.__code__.co_names]
    values += zip(
        function.__code__.co_freevars, (cell.cell_contents for cell in function.__closure__ or ()), strict=True
    )
    for name, value in values:
        if isinstance(value, FunctionType):
            yield from reached(value, seen, files)
        elif isinstance(value, int | float | tuple):
            yield f"{name} = {value!r}\n"
        elif isinstance(value, type) and issubclass(value, IntEnum):
            yield f"{name} = {list(value)!r}\n"
        elif isinstance(value, type) and value.__module__ in sys.modules and hasattr(value, "_fields"):
            files.add(Path(inspect.getfile(value)))


def _cached(dispatcher: Any, directory: Path) -> Any:
    """Return ``dispatcher``, whose machine code is kept in ``directory``, named by all that the code comes from."""
    import numba
    from numba.core.caching import FunctionCache

    class Cache(FunctionCache):  # type: ignore[misc]
        def _index_key(self, signature: Any, codegen: Any) -> Any:
            # Numba's own key adds the pickled closure, which differs from process to process
            return signature, codegen.magic_tuple()

    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(directory)
    try:
        dispatcher._cache = Cache(dispatcher.py_func)
    finally:
        numba.config.CACHE_DIR = before
    return dispatcher

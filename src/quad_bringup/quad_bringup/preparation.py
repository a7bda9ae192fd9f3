"""Machine code of a flight's laws and plant, built for the next flights and never before one.

python -m quad_bringup.preparation                      build what the default flight lacks (``scripts/setup``)
python -m quad_bringup.preparation MODULE:FUNCTION ...  build these, quietly
"""

import fcntl
import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from quad_bringup.terminal import write
from quad_core import guard
from quad_core.prediction import predict
from quad_core.resolution import Resolved
from quad_core.sources import cache_root
from quad_flight.set_up import Request, resolve_flight
from quad_native import library_path
from quad_native.build import CompilationError, build


def functions_of(node: Resolved) -> list[Callable[..., Any]]:
    """Return the functions that a node runs at every step and that can be machine code."""
    guards = [guard.step] if hasattr(node.node, "guard") and node.node.guard.enabled else []
    found = guards + [
        getattr(node.plugins[slot].module, name)
        for slot, names in (("law", ("step",)), ("plant", ("step", "lumped")))
        if slot in node.plugins and getattr(node.plugins[slot].module, "COMPILES", True)
        for name in names
    ]
    if getattr(getattr(node.node, "prediction", None), "enabled", False):
        found.append(predict)
    return found if node.flight.machine_code else []


def lacking(nodes: Iterable[Resolved]) -> dict[str, Callable[..., Any]]:
    """Return {MODULE:FUNCTION: function} of what ``nodes`` run without a library of its present text."""
    if find_spec("numba") is None:
        return {}
    every = (function for node in nodes for function in functions_of(node))
    return {f"{function.__module__}:{function.__qualname__}": function for function in every if _lacks(function)}


def build_lacking(nodes: Iterable[Resolved], prefix: str) -> None:
    """Build what ``nodes`` lack and wait for it; prints what it does, and why a function will be run by CPython."""
    found = lacking(nodes)
    if not found:
        return
    _print(prefix, f"compiling {', '.join(found)} ...")
    # processes of their own: Numba is large and takes one core each
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        mp_context=context, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_DFL)
    ) as pool:
        for number, problem in enumerate(pool.map(_problem_of, found.values()), start=1):
            _print(prefix, f"run by CPython: {problem}" if problem else f"compiled {number} of {len(found)}")


def build_in_background(nodes: Iterable[Resolved], prefix: str) -> "subprocess.Popen[bytes] | None":
    """Start building what ``nodes`` lack in a process that nobody waits for; None if nothing can be built.

    What could not be compiled before is named with the reason, and not tried again.
    """
    found = {}
    for name, function in lacking(nodes).items():
        reason = _reason_file(function)
        if not reason.is_file():
            found[name] = function
            continue
        _print(prefix, f"run by CPython: {reason.read_text()}")
        _print(prefix, f"to compile it again: python -m {__spec__.name} {name}")
    if not found:
        return None
    _print(prefix, f"compiling {', '.join(found)} in the background for the next flights")
    command = [sys.executable, "-m", __spec__.name, *found]
    nowhere = subprocess.DEVNULL
    return subprocess.Popen(command, stdin=nowhere, stdout=nowhere, stderr=nowhere, start_new_session=True)


def main(names: Sequence[str]) -> int:
    """Build the functions of ``names``, MODULE:FUNCTION; without any what the default flight lacks.

    Prints what came of each. Returns the exit code: 1 if one cannot be compiled or another process compiles now,
    2 if a name is none of a function.
    """
    if not names:
        build_lacking(resolve_flight(Request("hover"), {}).values(), "setup")
        return 0
    try:
        functions = {name: _named(name) for name in names}
    except ValueError as error:
        _print("compile", str(error))
        return 2
    os.nice(19)
    root = cache_root()
    root.mkdir(mode=0o700, parents=True, exist_ok=True)
    with (root / "building.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:  # another flight's process builds already; what it leaves out comes next time
            _print("compile", "another process compiles now: try again when it is done")
            return 1
        problems = []
        for name, function in functions.items():
            problem = _problem_of(function)
            _remember(function, problem)
            _print("compile", f"run by CPython: {problem}" if problem else f"compiled {name}")
            problems += [problem] if problem else []
    return 1 if problems else 0


def _named(name: str) -> Callable[..., Any]:
    """Return the function MODULE:FUNCTION; raises ValueError if there is none."""
    module, _, word = name.partition(":")
    try:
        found = getattr(import_module(module), word) if module and word else None
    except ImportError as error:
        raise ValueError(f"{name}: module {module!r} cannot be imported: {error}") from error
    except AttributeError as error:
        raise ValueError(f"{name}: module {module!r} has no function {word!r}") from error
    if not callable(found):
        raise ValueError(f"found {name!r}, expected MODULE:FUNCTION")
    function: Callable[..., Any] = found
    return function


def _lacks(function: Callable[..., Any]) -> bool:
    try:
        return not library_path(function).is_file()
    except (OSError, TypeError):  # none that could be built again when its text changes
        return False


def _problem_of(function: Callable[..., Any]) -> str:
    try:
        build(function)
    except (CompilationError, OSError) as error:
        return str(error)
    return ""


def _reason_file(function: Callable[..., Any]) -> Path:
    """Return where it stands why ``function``, as its text is now, could not be compiled."""
    return library_path(function).with_suffix(".reason")


def _remember(function: Callable[..., Any], problem: str) -> None:
    with suppress(OSError, TypeError):  # no place for it, or no text of its own: it is tried again
        if problem:
            _reason_file(function).parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            _reason_file(function).write_text(problem)
        else:
            _reason_file(function).unlink(missing_ok=True)


def _print(prefix: str, text: str) -> None:
    write(f"{prefix}: {text}\n", sys.stderr)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))

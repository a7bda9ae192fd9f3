"""Before a flight: the machine code of its laws and plant, made where there is none yet."""

import multiprocessing
import signal
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec

from quad_core import programs
from quad_core.machine_code import library_path
from quad_core.machine_code_build import CompilationError, build
from quad_core.node_parameters import Resolved
from quad_core.program import Program


def prepare(nodes: Iterable[Resolved]) -> None:
    """Build what ``nodes`` lack; says what it does, and why a program will be interpreted instead.

    Without Numba nothing is built: all is interpreted.
    """
    if find_spec("numba") is None:
        return
    lacking = {}
    for node in nodes:
        program = programs.of_node(node) if node.flight.machine_code else None
        if program is not None and not _is_there(program):
            lacking[program.name] = program
    if not lacking:
        return
    _say(f"compiling {', '.join(lacking)} (kept until their text changes) ...")
    # processes of their own: Numba is large and takes one core each
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        mp_context=context, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_DFL)
    ) as pool:
        for number, problem in enumerate(pool.map(_problem_of, lacking.values()), start=1):
            _say(f"interpreted: {problem}" if problem else f"compiled {number} of {len(lacking)}")


def _is_there(program: Program) -> bool:
    try:
        return library_path(program).is_file()
    except (OSError, TypeError):  # none that could be built again when its text changes
        return True


def _problem_of(program: Program) -> str:
    try:
        build(program)
    except (CompilationError, OSError) as error:
        return str(error)
    return ""


def _say(text: str) -> None:
    sys.stderr.write(f"fly: {text}\n")
    sys.stderr.flush()

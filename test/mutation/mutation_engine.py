"""Put one small mistake into one function of a copied source tree and see whether the unit tests notice."""

import ast
import contextlib
import importlib
import os
import re
import resource
import shutil
import signal
import sys
import time
from functools import lru_cache
from pathlib import Path
from textwrap import indent
from typing import NamedTuple

# Loaded once before forking: most of a short test run is importing these.
HEAVY = ("sympy", "mpmath", "numpy", "scipy.integrate", "scipy.spatial.transform", "scipy.optimize", "hypothesis")
# fmt: off
COPIED = (
    "src", "studies", "test/paper", "test/accept", "test/long_tests.txt", "docs", "pyproject.toml", "conftest.py",
    "scripts/lib",
    "examples/layouts",
)
# fmt: on
PAPER_TESTS = {
    "quad_core": ["model_terms", "abfnitsm_step plant_terms"],
    "quad_position_ctrl": ["aibs_step closed_loop_identities"],
    "quad_attitude_ctrl": ["abfnitsm_terms", "abfnitsm_step closed_loop_identities"],
    "quad_dynamics": ["plant_terms"],
}
# CPU time, so that a busy machine is not taken for an endless loop.
SECONDS_PER_MUTANT = 120
SECONDS_UNMUTATED = 1800
MEMORY = 4 << 30
"""Bytes of data that a run of tests may have: a mistake in a loop's end makes logs without end."""
TIME_UP = -signal.SIGXCPU
# A test failed; a module of tests could not be collected; and the same where single tests were named.
NOTICED = (1, 2, 4)
COMPILED_TESTS = "not numba and not compiled and not bit_equal and not same_bits"


class Mutation(NamedTuple):
    """One mistake: in ``function`` (dotted), ``old`` becomes ``new``; both as ``ast.unparse`` writes code."""

    equation: str
    function: str
    old: str
    new: str

    def __str__(self) -> str:
        """Return what people filter by and read."""
        return f"{self.equation}: {self.function}: {self.old!r} -> {self.new!r}"


class MutationError(ValueError):
    """A declared mutation does not fit the sources; the text says which and why."""


class Outcome(NamedTuple):
    """What the tests made of one mutation; ``timed_out``: no test failed, and some had no end in their time."""

    mutation: Mutation
    killed_by: str
    seconds: float
    timed_out: bool = False

    @property
    def verdict(self) -> str:
        """Who noticed, in words."""
        return self.killed_by or (f"no end within {SECONDS_PER_MUTANT} s of CPU time" if self.timed_out else "NOBODY")


def split(function: str) -> tuple[list[str], list[str]]:
    """Return the module and, within it, the function of a dotted name; a method stands in a class with a capital."""
    parts = function.split(".")
    inner = 2 if parts[-2][:1].isupper() else 1
    return parts[:-inner], parts[-inner:]


def source_file(root: Path, mutation: Mutation) -> Path:
    """Return the file that holds the mutated function."""
    module, _ = split(mutation.function)
    folder = root / "src" / module[0] if len(module) > 1 else root / "studies"
    return folder / Path(*module).with_suffix(".py")


def mutated(source: str, mutation: Mutation) -> str:
    """Return ``source`` with the mistake in it; comments and layout of the function do not matter.

    Raises MutationError if the function is not there, the snippet is not there exactly once, or nothing changes.
    """
    first, last, column, text = function_in(source, mutation.function)
    if text.count(mutation.old) != 1:
        raise MutationError(f"{mutation}: found it {text.count(mutation.old)} times, expected once, in\n{text}")
    try:
        changed = ast.unparse(ast.parse(text.replace(mutation.old, mutation.new)))
    except SyntaxError as error:
        raise MutationError(f"{mutation}: the result is not Python: {error}") from error
    if changed == text:
        raise MutationError(f"{mutation}: changes nothing")
    lines = source.splitlines()
    return "\n".join([*lines[:first], indent(changed, " " * column), *lines[last:], ""])


@lru_cache(maxsize=256)
def function_in(source: str, function: str) -> tuple[int, int, int, str]:
    """Return first and last line and column of a function or table in ``source``, and its code without docstring."""
    *classes, name = split(function)[1]
    body = ast.parse(source).body
    for class_name in classes:
        body = [
            part for node in body if isinstance(node, ast.ClassDef) and node.name == class_name for part in node.body
        ]
    named = {ast.FunctionDef: lambda node: node.name, ast.AnnAssign: lambda node: ast.unparse(node.target)}
    found = [node for node in body if type(node) in named and named[type(node)](node) == name]
    if len(found) != 1:
        raise MutationError(f"{function}: found {len(found)} functions {name!r}, expected 1")
    node = found[0]
    if isinstance(node, ast.FunctionDef) and ast.get_docstring(node) is not None:
        node.body = node.body[1:]
    first = min(part.lineno for part in (node, *getattr(node, "decorator_list", ()))) - 1
    return first, node.end_lineno or first, node.col_offset, ast.unparse(node)


def copy_tree(root: Path, tree: Path) -> None:
    """Copy what the unit tests need from ``root`` to the new folder ``tree``."""
    for name in COPIED:
        source, target = root / name, tree / name
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__", ".hypothesis", "*.egg-info"))
        elif source.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)


def load_heavy() -> None:
    """Import what most tests import, so that forked test runs need not."""
    for name in (*HEAVY, "pytest"):
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


def run_tests(tree: Path, paths: list[str], output: Path, *, seconds: int | None = None) -> int:
    """Run pytest over ``paths`` of ``tree`` in a forked process; return its exit code, TIME_UP when its time is up.

    ``seconds`` of CPU time, by default SECONDS_PER_MUTANT.
    """
    child = os.fork()
    if child == 0:
        _be_pytest(tree, paths, output, SECONDS_PER_MUTANT if seconds is None else seconds)
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status)


def _be_pytest(tree: Path, paths: list[str], output: Path, seconds: int) -> None:
    import pytest

    code = 70
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
        log = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.chdir(tree)
        sys.dont_write_bytecode = True
        flags = ["-x", "-q", "--no-header", "--tb=line", "-p", "no:cacheprovider", "-m", "not ros or unit"]
        flags += ["--hypothesis-profile", "mutation"]
        code = int(pytest.main([*flags, "-k", COMPILED_TESTS, *paths]))
        sys.stdout.flush()
    finally:
        os._exit(code)


def end_of(output: Path) -> str:
    """Return the last lines of what pytest said."""
    return "\n".join(output.read_text(encoding="utf-8", errors="replace").splitlines()[-30:])


def first_failure(output: Path) -> str:
    """Return the first failed test that pytest reported in ``output``."""
    for line in output.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith(("FAILED ", "ERROR ")):
            return line.split(" ", 1)[1].split(" - ")[0]
    return "no report"


def test_paths(root: Path, function: str) -> list[list[str]]:
    """Return the tests for a mutation of ``function`` in the order in which to try them: the quick and telling first.

    The module's own, then those of the paper, then the others of its package, first of them those that name it.
    """
    package, module = split(function)[0][0], split(function)[0][-1]
    stages = [[f"test/paper/test_{name}.py" for name in stage.split()] for stage in PAPER_TESTS.get(package, [])]
    folder = root / "studies" if package == module else root / "src" / package
    files = sorted((folder / "test").glob("test_*.py"))
    mirror = [file for file in files if file.stem.endswith(f"_{module}")]
    names_it = re.compile(rf"\b{module}\b")
    rest = [file for file in files if file not in mirror]
    rest.sort(key=lambda file: not names_it.search(file.read_text(encoding="utf-8")))
    own, others = ([str(file.relative_to(root)) for file in found] for found in (mirror, rest))
    return [stage for stage in (own, *stages, others) if stage]


def judge(tree: Path, mutation: Mutation, tests: list[str] | None = None) -> Outcome:
    """Put ``mutation`` into ``tree``, run ``tests`` (by default all unit tests) until one fails, take it out again.

    Tests whose time is up have noticed nothing: the next ones are run.
    """
    start = time.monotonic()
    stages = test_paths(tree, mutation.function) if tests is None else [tests]
    file = source_file(tree, mutation)
    original = file.read_text(encoding="utf-8")
    file.write_text(mutated(original, mutation), encoding="utf-8")
    output = tree / "pytest.log"
    killed_by, timed_out = "", False
    try:
        for paths in stages:
            code = run_tests(tree, paths, output)
            if code in NOTICED:
                killed_by = first_failure(output)
                break
            if code not in (0, 5, TIME_UP):
                raise MutationError(f"{mutation}: pytest ended with {code}; see its end:\n{end_of(output)}")
            timed_out |= code == TIME_UP
    finally:
        file.write_text(original, encoding="utf-8")
    return Outcome(mutation, killed_by, time.monotonic() - start, timed_out and not killed_by)

"""Making a library: Numba compiles the function, the C compiler links it with the glue."""

import os
import re
import shutil
import subprocess
import sysconfig
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from quad_core.compilation import compiled
from quad_core.records import field_kinds, leaves
from quad_native.glue import glue_text
from quad_native.loading import library_path, load
from quad_native.signature import Signature, signature_of

COLOURS = re.compile(r"\x1b\[[0-9;]*m")  # Numba colours its messages, on a terminal or not


class CompilationError(TypeError):
    """A function that cannot be compiled; the text gives the reason."""


def build(function: Callable[..., Any]) -> Path:
    """Make and return the library of a pure function; one that is there is kept.

    Raises CompilationError if its text, or this machine, does not allow it.
    """
    name = f"{getattr(function, '__module__', '?')}.{getattr(function, '__qualname__', '?')}"
    try:
        path = library_path(function)
        if path.is_file():
            return path
        import llvmlite.binding as llvm
        from numba.core.errors import NumbaError
    except (ImportError, OSError, TypeError) as error:
        raise CompilationError(f"{name}: {error}") from error
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        raise CompilationError(f"{name}: no C compiler to link it with")
    signature = signature_of(function)
    try:
        text = _compiled_text(function, signature)
    except (NumbaError, TypeError) as error:
        raise CompilationError(f"{name}: {' '.join(COLOURS.sub('', str(error)).split())[:600]}") from error
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    # the processor's family and no more: a cache may be shared by machines
    machine = llvm.Target.from_default_triple().create_target_machine(opt=3, reloc="pic")
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="new-", dir=path.parent) as scratch:
        entry, glue, made = Path(scratch, "entry.o"), Path(scratch, "glue.c"), Path(scratch, path.name)
        entry.write_bytes(machine.emit_object(_only_entry(llvm, text, machine)))
        glue.write_text(glue_text(signature), encoding="utf-8")
        headers = f"-I{sysconfig.get_paths()['include']}"
        command = [compiler, "-O2", "-w", "-fPIC", "-shared", headers]
        command += ["-o", str(made), str(glue), str(entry), "-lm"]
        linked = subprocess.run(command, capture_output=True, text=True, check=False)
        if linked.returncode:
            raise CompilationError(f"{name}: {' '.join(command)}: {linked.stderr.strip()[-600:]}")
        try:
            load(made)
        except ImportError as error:
            raise CompilationError(f"{name}: {error}") from error
        made.replace(path)
    return path


def _compiled_text(function: Callable[..., Any], signature: Signature) -> str:
    """Return LLVM's text of an entry that takes the block of cells and calls ``function`` on it."""
    from numba import carray, int64, njit, types

    scope: dict[str, Any] = {"carray": carray, "int64": int64, "function": compiled(function)}
    lines = [
        "def entry(block):",
        f"    numbers = carray(block, ({signature.cells},))",
        "    wholes = numbers.view(int64)",
    ]
    at, taken = 0, []
    for kind in signature.takes:
        taken.append(_read(kind, at, scope))
        at += len(leaves(kind))
    lines.append(f"    result = function({', '.join(taken)})")
    for place, kind in enumerate(signature.gives):
        lines += _written(kind, at, "result" if signature.single else f"result[{place}]")
        at += len(leaves(kind))
    exec("\n".join(lines), scope)
    declared = types.void(types.CPointer(types.float64))
    dispatcher = njit(declared, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)(scope["entry"])
    return str(dispatcher.inspect_llvm(dispatcher.signatures[0]))


def _read(kind: type[Any], at: int, scope: dict[str, Any]) -> str:
    """Return the expression that makes a value from its cells."""
    if not hasattr(kind, "_fields"):
        return {float: f"numbers[{at}]", int: f"wholes[{at}]", bool: f"wholes[{at}] != 0"}[kind]
    name = f"{kind.__module__}.{kind.__qualname__}".replace(".", "_")
    scope[name] = kind
    parts = []
    for inner in field_kinds(kind).values():
        parts.append(_read(inner, at, scope))
        at += len(leaves(inner))
    return f"{name}({', '.join(parts)})"


def _written(kind: type[Any], at: int, value: str) -> list[str]:
    """Return the lines that write the numbers of ``value`` to its cells."""
    lines = []
    for number, leaf in enumerate(leaves(kind), start=at):
        found = f"{value}{'.' if leaf.name else ''}{leaf.name}"
        # Numba would cut a float to fit; `| 0` it refuses to do with one
        lines.append(
            f"    numbers[{number}] = {found}" if leaf.kind is float else f"    wholes[{number}] = {found} | 0"
        )
    return lines


def _only_entry(llvm: Any, text: str, machine: Any) -> Any:
    """Return the module of ``text`` with its entry renamed and all that this does not use left out."""
    module = llvm.parse_assembly(text)
    for function in module.functions:
        if function.is_declaration:
            continue
        if "dynamic" in function.name and "entry" in function.name:
            function.name = "entry"
        else:
            function.linkage = "internal"
    for variable in module.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options()))
    return module

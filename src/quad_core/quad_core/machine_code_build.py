"""Machine code of a program: its functions compiled by Numba, linked by the C compiler into a plain library."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from quad_core.compilation import compiled
from quad_core.machine_code import library_path, offsets
from quad_core.program import Call, Program, field_kinds, leaves


class CompilationError(TypeError):
    """A program that no machine code can be made of; the text says why."""


def build(program: Program) -> Path:
    """Make and return the library of a program; one that is there is kept.

    Raises CompilationError if its text, or this machine, does not allow it.
    """
    try:
        path = library_path(program)
        if path.is_file():
            return path
        import llvmlite.binding as llvm
        from numba.core.errors import NumbaError
    except (ImportError, OSError, TypeError) as error:
        raise CompilationError(f"{program.name}: {error}") from error
    linker = shutil.which(os.environ.get("CC", "cc"))
    if linker is None:
        raise CompilationError(f"{program.name}: no C compiler to link it with")
    try:
        texts = {name: _compiled_text(program, calls) for name, calls in program.entries.items()}
    except (NumbaError, TypeError) as error:
        raise CompilationError(f"{program.name}: {' '.join(str(error).split())[:600]}") from error
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    # the processor's family and no more: a cache may be shared by machines
    machine = llvm.Target.from_default_triple().create_target_machine(opt=3, reloc="pic")
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="new-", dir=path.parent) as scratch:
        objects = []
        for name, text in texts.items():
            objects.append(Path(scratch, f"{name}.o"))
            objects[-1].write_bytes(machine.emit_object(_only(llvm, text, name, machine)))
        made = Path(scratch, path.name)
        command = [linker, "-shared", "-Wl,--no-undefined", "-o", str(made), *map(str, objects), "-lm"]
        linked = subprocess.run(command, capture_output=True, text=True, check=False)
        if linked.returncode:
            raise CompilationError(f"{program.name}: {' '.join(command)}: {linked.stderr.strip()[-600:]}")
        made.replace(path)
    return path


def _compiled_text(program: Program, calls: Sequence[Call]) -> str:
    """Return LLVM's text of a function that takes the block of ``program`` and makes ``calls`` on it."""
    from numba import carray, int64, njit, types

    scope: dict[str, Any] = {"carray": carray, "int64": int64}
    begins = offsets(program)
    lines = [
        "def entry(block):",
        f"    numbers = carray(block, ({begins['']},))",
        "    wholes = numbers.view(int64)",
    ]
    for place, call in enumerate(calls):
        scope[f"call_{place}"] = compiled(call.function)
        taken = ", ".join(_read(program.slots[name], begins[name], scope) for name in call.takes)
        lines.append(f"    result = call_{place}({taken})")
        for number, name in enumerate(call.gives):
            value = "result" if len(call.gives) == 1 else f"result[{number}]"
            lines += _written(program.slots[name], begins[name], value)
    exec("\n".join(lines), scope)
    signature = types.void(types.CPointer(types.float64))
    dispatcher = njit(signature, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)(scope["entry"])
    return str(dispatcher.inspect_llvm(dispatcher.signatures[0]))


def _read(kind: type[Any], at: int, scope: dict[str, Any]) -> str:
    """Return the expression that makes the value of a slot from its numbers."""
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
    """Return the lines that write the numbers of ``value``."""
    lines = []
    for number, leaf in enumerate(leaves(kind), start=at):
        found = f"{value}{'.' if leaf.name else ''}{leaf.name}"
        # Numba would cut a float to fit; `| 0` it refuses to do with one
        lines.append(
            f"    numbers[{number}] = {found}" if leaf.kind is float else f"    wholes[{number}] = {found} | 0"
        )
    return lines


def _only(llvm: Any, text: str, name: str, machine: Any) -> Any:
    """Return the module of ``text`` with its one entry renamed to ``name`` and all that it does not use left out."""
    module = llvm.parse_assembly(text)
    for function in module.functions:
        if function.is_declaration:
            continue
        if "dynamic" in function.name and "entry" in function.name:
            function.name = name
        else:
            function.linkage = "internal"
    for variable in module.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options()))
    return module

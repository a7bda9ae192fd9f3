"""The rules of pure text, put to one function: see ``quad_core.purity``."""

import ast
import inspect
import math
from collections.abc import Iterator
from enum import IntEnum
from types import FunctionType
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

BUILTINS = {"abs", "bool", "float", "int", "len", "range"}
# fmt: off
MATH = {
    "acos", "asin", "atan", "atan2", "copysign", "cos", "cosh", "e", "exp", "fabs", "floor", "inf", "isfinite", "isinf",
    "isnan", "log", "nan", "pi", "sin", "sinh", "sqrt", "tan", "tanh", "tau",
}
# fmt: on
NEVER_NEGATIVE = {"abs", "math.fabs", "math.sqrt", "math.exp", "math.cosh"}
CONSTRUCTS: dict[type[ast.AST], tuple[str, str]] = {
    ast.GeneratorExp: ("a generator", "a loop or the terms written out"),
    ast.Try: ("try", "a check before what could raise"),
    ast.With: ("with", "plain arithmetic"),
    ast.Assert: ("assert", "a check that returns a bounded value"),
    ast.Lambda: ("a lambda", "a named function of the module"),
    ast.FunctionDef: ("a function inside a function", "a named function of the module"),
    ast.ClassDef: ("a class inside a function", "a NamedTuple of the module"),
    ast.Import: ("an import inside a function", "an import at the top of the module"),
    ast.ImportFrom: ("an import inside a function", "an import at the top of the module"),
    ast.Global: ("global", "the value in the memory that step returns"),
    ast.Nonlocal: ("nonlocal", "the value in the memory that step returns"),
    ast.Delete: ("del", "a new value"),
    ast.JoinedStr: ("an f-string", "numbers only"),
    ast.List: ("a list", "a tuple or a NamedTuple"),
    ast.Dict: ("a dict", "a NamedTuple"),
    ast.Set: ("a set", "a tuple or a NamedTuple"),
    ast.Starred: ("a starred value", "every value written out"),
    ast.Yield: ("yield", "return"),
    ast.YieldFrom: ("yield", "return"),
    ast.Await: ("await", "a plain function"),
    ast.Match: ("match", "if and elif"),
    ast.Is: ("is", "a comparison of numbers"),
    ast.IsNot: ("is not", "a comparison of numbers"),
    ast.In: ("in", "comparisons of numbers"),
    ast.NotIn: ("not in", "comparisons of numbers"),
}
CONSTRUCTS |= dict.fromkeys((ast.ListComp, ast.SetComp, ast.DictComp), ("a comprehension", "a loop"))


class Finding(NamedTuple):
    """One place of pure text that breaks a rule."""

    path: str
    line: int
    function: str
    found: str
    expected: str

    def __str__(self) -> str:
        """Return the finding as compilers print theirs."""
        return f"{self.path}:{self.line}: {self.function}: found {self.found}, expected {self.expected}"


def examined(function: Any, may_raise: bool) -> tuple[list[Finding], list[Any]]:
    """Return what breaks the rules in the text of ``function``, and the functions that it names."""
    visitor = _Visitor(function, may_raise)
    visitor.run()
    return visitor.findings, visitor.reached


class _Visitor(ast.NodeVisitor):
    """Walks one function; names are resolved in the module that holds it."""

    def __init__(self, function: Any, may_raise: bool) -> None:
        self.function = function
        self.may_raise = may_raise
        self.findings: list[Finding] = []
        self.reached: list[Any] = []
        self.path = getattr(inspect.getmodule(function), "__file__", None) or "?"
        self.name = getattr(function, "__name__", repr(function))
        self.definition: ast.FunctionDef | None = None

    def run(self) -> None:
        if not isinstance(self.function, FunctionType):
            self.findings.append(Finding(self.path, 0, self.name, repr(self.function), "a plain function"))
            return
        lines, first = inspect.getsourcelines(self.function)
        tree = ast.parse(inspect.cleandoc("\n" + "".join(lines)) if lines[0][:1].isspace() else "".join(lines))
        ast.increment_lineno(tree, first - 1)
        definition = tree.body[0]
        if not isinstance(definition, ast.FunctionDef):
            self.report(definition, "no plain function", "def at the top of the module")
            return
        self.definition = definition
        arguments = [*definition.args.posonlyargs, *definition.args.args, *definition.args.kwonlyargs]
        stored = {
            node.id for node in ast.walk(definition) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
        }
        self.locals = stored | {argument.arg for argument in arguments}
        if definition.decorator_list:
            self.report(definition, "a decorator", "a plain function")
        if definition.args.vararg or definition.args.kwarg:
            self.report(definition, "* or ** among the arguments", "every argument by name")
        self.returns_float = _hints(self.function).get("return") is float
        body = definition.body
        for statement in body[1:] if ast.get_docstring(definition) is not None else body:
            self.visit(statement)

    def report(self, node: ast.AST, found: str, expected: str) -> None:
        self.findings.append(Finding(self.path, getattr(node, "lineno", 0), self.name, found, expected))

    def generic_visit(self, node: ast.AST) -> None:
        if type(node) in CONSTRUCTS:
            self.report(node, *CONSTRUCTS[type(node)])
            return
        super().generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        self.visit(node.target)
        if node.value is not None:
            self.visit(node.value)

    def visit_Compare(self, node: ast.Compare) -> None:
        for operator in node.ops:
            if type(operator) in CONSTRUCTS:
                self.report(node, *CONSTRUCTS[type(operator)])
        for part in (node.left, *node.comparators):
            self.visit(part)

    def visit_Constant(self, node: ast.Constant) -> None:
        if not isinstance(node.value, int | float):
            self.report(node, repr(node.value), "numbers only")

    def visit_Raise(self, node: ast.Raise) -> None:
        call = node.exc
        constant = isinstance(call, ast.Call) and all(isinstance(part, ast.Constant) for part in call.args)
        if not self.may_raise:
            self.report(node, "raise", "a bounded value: a step in flight always answers")
        elif not constant:
            self.report(node, "raise with a text made on the spot", "an error of constant text: Numba takes no other")

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is None:
            self.report(node, "a bare return", "a value")
            return
        if self.returns_float and _is_integer(node.value):
            self.report(node, "an integer", f"{ast.unparse(node.value)}.0: the function returns a float")
        self.visit(node.value)

    def visit_Name(self, node: ast.Name) -> None:
        if node.id in self.locals:
            return
        value = self.resolve(node.id)
        if isinstance(value, FunctionType):
            self.reached.append(value)
        elif self.may_raise and (value is np.zeros or node.id == "ord"):
            return
        elif not (
            value is math or _is_number(value) or _is_named_tuple(value) or _is_enum(value) or node.id in BUILTINS
        ):
            self.report(
                node, node.id, "a constant, a function, a NamedTuple or an IntEnum imported by name, or the module math"
            )

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if self.is_math(node.value):
            if node.attr not in MATH:
                self.report(node, f"math.{node.attr}", f"arithmetic or one of {', '.join(sorted(MATH))}")
            return
        self.visit(node.value)

    def visit_Call(self, node: ast.Call) -> None:
        called = node.func
        if isinstance(called, ast.Attribute) and not self.is_math(called.value):
            self.report(node, f"a call of the method {called.attr}", "a function imported by name")
        elif isinstance(called, ast.Name) and called.id not in self.locals:
            if _is_enum(self.resolve(called.id)):
                self.report(node, f"a call of {called.id}", f"a member of it by name: Numba makes no {called.id}")
            self.check_arguments(node, self.resolve(called.id))
        self.visit(called)
        for argument in (*node.args, *(keyword.value for keyword in node.keywords)):
            self.visit(argument)

    def check_arguments(self, node: ast.Call, called: Any) -> None:
        """Check that every field of a NamedTuple is given, and that no integer stands where a float is expected."""
        if _is_named_tuple(called):
            fields = tuple(called._fields)
            given = len(node.args) + len(node.keywords)
            if given != len(fields) and not any(isinstance(argument, ast.Starred) for argument in node.args):
                self.report(node, f"{given} fields of {called.__name__}", f"all {len(fields)} written out")
        elif isinstance(called, FunctionType):
            fields = called.__code__.co_varnames[: called.__code__.co_argcount]
        else:
            return
        hints = _hints(called)
        named = [*zip(fields, node.args, strict=False), *((word.arg or "", word.value) for word in node.keywords)]
        for name, value in named:
            if hints.get(name) is float and _is_integer(value):
                self.report(value, f"the integer {ast.unparse(value)} for {name}", "a float")

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if isinstance(node.op, ast.Pow):
            self.check_power(node, node.left, node.right)
        self.visit(node.left)
        self.visit(node.right)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        if isinstance(node.op, ast.Pow):
            self.check_power(node, node.target, node.value)
        self.visit(node.target)
        self.visit(node.value)

    def check_power(self, node: ast.AST, base: ast.expr, exponent: ast.expr) -> None:
        for value in self.constants(exponent):
            if 2.0 * value == math.floor(2.0 * value):
                self.report(
                    node, f"the power {ast.unparse(node)}", "x * x, a quotient or math.sqrt: pow differs by a bit"
                )
                return
        if isinstance(exponent, ast.Constant | ast.UnaryOp):
            self.report(node, f"the constant exponent {ast.unparse(exponent)}", "a named one: compilers rewrite it")
        if not self.never_negative(base):
            self.report(node, f"the base {ast.unparse(base)}", "one that is seen not to be negative, as abs(x)")

    def constants(self, node: ast.expr) -> Iterator[float]:
        """Yield the numbers that an exponent is known to be."""
        try:
            yield float(ast.literal_eval(node))
        except (ValueError, TypeError):
            if isinstance(node, ast.Name):
                if node.id not in self.locals and _is_number(self.resolve(node.id)):
                    yield self.resolve(node.id)
                for value in self.assigned(node.id):
                    if isinstance(value, ast.Constant | ast.UnaryOp):
                        yield from self.constants(value)

    def assigned(self, name: str) -> list[ast.expr | None]:
        """Return what is assigned to a local name; None where that is not a plain assignment."""
        found: list[ast.expr | None] = []
        for node in ast.walk(self.definition) if self.definition else ():
            if isinstance(node, ast.Assign | ast.AnnAssign):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                for target in targets:
                    if isinstance(target, ast.Name) and target.id == name:
                        found.append(node.value)
                    elif any(isinstance(part, ast.Name) and part.id == name for part in ast.walk(target)):
                        found.append(None)
            elif isinstance(node, ast.AugAssign | ast.For) and any(
                isinstance(part, ast.Name) and part.id == name for part in ast.walk(node.target)
            ):
                found.append(None)
        return found

    def never_negative(self, node: ast.expr | None, depth: int = 8) -> bool:
        if depth == 0 or node is None:
            return False
        if isinstance(node, ast.Constant):
            return isinstance(node.value, int | float) and node.value >= 0
        if isinstance(node, ast.Call):
            return ast.unparse(node.func) in NEVER_NEGATIVE
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Mult | ast.Div):
            square = isinstance(node.op, ast.Mult) and ast.unparse(node.left) == ast.unparse(node.right)
            return square or (self.never_negative(node.left, depth - 1) and self.never_negative(node.right, depth - 1))
        if isinstance(node, ast.Name):
            values = self.assigned(node.id)
            if not values and node.id not in self.locals:
                value = self.resolve(node.id)
                return _is_number(value) and value >= 0
            return bool(values) and all(self.never_negative(value, depth - 1) for value in values)
        return False

    def is_math(self, node: ast.expr) -> bool:
        return isinstance(node, ast.Name) and node.id not in self.locals and self.resolve(node.id) is math

    def resolve(self, name: str) -> Any:
        return self.function.__globals__.get(name)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) or (isinstance(value, tuple) and all(map(_is_number, value)))


def _is_named_tuple(value: Any) -> bool:
    return isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields")


def _is_enum(value: Any) -> bool:
    return isinstance(value, type) and issubclass(value, IntEnum)


def _is_integer(node: ast.expr) -> bool:
    value = node.operand if isinstance(node, ast.UnaryOp) else node
    return isinstance(value, ast.Constant) and isinstance(value.value, int)


def _hints(holder: Any) -> dict[str, Any]:
    hints = get_type_hints(holder, include_extras=True)
    return {name: get_args(hint)[0] if get_origin(hint) is Annotated else hint for name, hint in hints.items()}

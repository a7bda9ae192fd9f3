"""What a pure function takes and gives, from its annotations."""

from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

from quad_core.records import leaves


class Signature(NamedTuple):
    """Classes of arguments and results, in order; ``single``: the one result stands alone, not in a tuple."""

    takes: tuple[type[Any], ...]
    gives: tuple[type[Any], ...]
    single: bool

    @property
    def cells(self) -> int:
        """How many numbers go in and out."""
        return sum(len(leaves(kind)) for kind in (*self.takes, *self.gives))


def signature_of(function: Callable[..., Any]) -> Signature:
    """Return the signature of a plain function of numbers and NamedTuples of numbers.

    Raises TypeError, naming the argument, for any other function.
    """
    if not isinstance(function, FunctionType):
        raise TypeError(f"found {function!r}, expected a plain function")
    hints = get_type_hints(function)
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    lacking = [name for name in (*names, "return") if name not in hints]
    if lacking:
        raise TypeError(f"{function.__module__}.{function.__qualname__}: {lacking[0]}: found no annotation")
    result = hints["return"]
    single = get_origin(result) is not tuple
    gives = (result,) if single else get_args(result)
    takes = tuple(hints[name] for name in names)
    for name, kind in (*zip(names, takes, strict=True), *(("return", kind) for kind in gives)):
        leaves(kind, name)
    return Signature(takes, gives, single)

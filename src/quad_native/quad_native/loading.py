"""Finding and loading the library that was built for a pure function."""

import importlib.util
from collections.abc import Callable, Iterator
from importlib.machinery import ExtensionFileLoader
from pathlib import Path
from typing import Any

from quad_core.ownership import NotOursError, check_file
from quad_core.records import NUMBERS, field_kinds
from quad_core.sources import cache_root, source_hash
from quad_native.signature import Signature, signature_of

MODULE = "quad_native_function"
"""Name of the extension module that every library is."""


class NativeError(RuntimeError):
    """A library is there and cannot be used; the text names it and the reason."""


def native(function: Callable[..., Any]) -> Callable[..., Any] | None:
    """Return ``function`` as machine code, called just as it is; None if no library was built for its present text.

    Raises NativeError if there is a library that does not load, or that others may change.
    """
    try:
        path = library_path(function)
        if not path.is_file():
            return None
    except NotOursError as error:
        raise NativeError(str(error)) from error
    except (OSError, TypeError):  # not a function that could have a library
        return None
    try:
        check_file(path)
        module = load(path)
        module.bind(tuple(classes(signature_of(function))))
        step: Callable[..., Any] = module.call
    except (ImportError, OSError, AttributeError, TypeError) as error:
        raise NativeError(f"{path}: cannot be used: {' '.join(str(error).split())}") from error
    return step


def load(path: Path) -> Any:
    """Return the extension module in a library; raises ImportError if it cannot be loaded."""
    spec = importlib.util.spec_from_file_location(MODULE, path, loader=ExtensionFileLoader(MODULE, str(path)))
    if spec is None:
        raise ImportError(f"{path}: no extension module")
    return importlib.util.module_from_spec(spec)


def library_path(function: Callable[..., Any]) -> Path:
    """Return where the library of a function is kept; the name changes with every source file that it reaches.

    Raises TypeError for what is not a plain function of numbers, OSError for a function without a source file.
    """
    signature = signature_of(function)
    name = f"{function.__module__}.{function.__qualname__}"
    text = " ".join(f"{kind.__module__}.{kind.__qualname__}:{list(_names(kind))}" for kind in classes(signature))
    here = Path(__file__)
    builders = (here, *(here.with_name(f"{part}.py") for part in ("build", "glue", "signature")))
    key = source_hash([function], builders, f"{name} {text}")
    return cache_root() / "native" / f"{name.replace('.', '-')}-{key}.so"


def classes(signature: Signature) -> list[type[Any]]:
    """Return every NamedTuple class of a signature once, each after those that it holds."""
    found: dict[type[Any], None] = {}
    for kind in (*signature.takes, *signature.gives):
        for inner in _inside(kind):
            found.setdefault(inner)
    return list(found)


def _inside(kind: type[Any]) -> Iterator[type[Any]]:
    if kind in NUMBERS:
        return
    for inner in field_kinds(kind).values():
        yield from _inside(inner)
    yield kind


def _names(kind: type[Any]) -> Iterator[str]:
    return (f"{name}:{inner.__name__}" for name, inner in field_kinds(kind).items())

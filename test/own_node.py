"""The nodes of examples/own_nodes as modules, for the tests."""

import importlib.util
from pathlib import Path


def loaded(path: Path):
    """Return the module in the file ``path``."""
    spec = importlib.util.spec_from_file_location(f"own_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module

"""The YAML files that come with the stack: vehicles, controllers, scenarios, limits."""

from pathlib import Path

from quad_core.parameters import ParameterError

VEHICLES = "vehicles"
CONTROLLERS = "controllers"
SCENARIOS = "scenarios"
LIMITS = "limits"


def root() -> Path:
    """Return the directory of the shipped files; they lie in the package, so that no ament index is needed."""
    return Path(__file__).parent / "config"


def names(kind: str) -> list[str]:
    """Return the sorted names of the files of one kind."""
    return sorted(path.stem for path in (root() / kind).glob("*.yaml"))


def find(kind: str, name: str | Path) -> Path:
    """Return the file that ``name`` stands for: one that comes with the stack, or the path of a YAML file.

    Raises ParameterError if there is no such file.
    """
    if str(name) in names(kind):
        return root() / kind / f"{name}.yaml"
    if str(name).endswith((".yaml", ".yml")) and Path(name).is_file():
        return Path(name)
    raise ParameterError(f"{kind}: found {str(name)!r}, expected {', '.join(names(kind))} or the path of a YAML file")

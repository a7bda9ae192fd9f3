"""The loop bound to plug-ins: plain Python, or compiled by Numba with a cache that knows its sources."""

import inspect
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

from quad_core import compilation, sources
from quad_core.compilation import compiled
from quad_core.cycle import behind_check
from quad_flight import loop, rows, stages


class EngineError(RuntimeError):
    """A flight cannot be flown compiled; the text names the plug-in and what Numba said."""


class Modules(NamedTuple):
    """The plug-in modules of one flight; ``stages``: one per stage of the cascade."""

    plant: ModuleType
    disturbance: ModuleType
    trajectory: ModuleType
    sensing: ModuleType
    stages: Any


class Engine(NamedTuple):
    """The functions of ``loop``, bound to plug-ins: ``fly`` without log, ``fly_logged`` with."""

    take_off: Any
    fly: Any
    fly_logged: Any


@cache
def python_engine(modules: Modules) -> Engine:
    """Return the loop as plain Python."""
    return _bound(modules, rows.quick_writer(modules.stages))


@cache
def compiled_engine(modules: Modules) -> Engine:
    """Return the loop compiled by Numba; compiled once per state of the sources, kept in the user's cache."""
    directory = sources.cache_root() / source_hash(modules)
    plain = _bound(modules, rows.writer(modules.stages))
    return Engine(*(_cached(compiled(function), directory) for function in plain))


def source_hash(modules: Modules) -> str:
    """Return a hash over the stages and over every source file that the bound loop reaches, plug-ins included."""
    bound = _functions(modules)
    names = " ".join(f"{name} {function.__module__}.{function.__qualname__}" for name, function in bound.items())
    made = "\n".join([names, stages.text(), *rows.names(modules.stages)])
    steps = [module.step for module in modules.stages]
    files = [Path(inspect.getfile(module)) for module in (compilation, rows, stages)]
    return sources.source_hash([*python_engine(modules), *steps], files, made)


def explain(modules: Modules, error: Exception) -> EngineError:
    """Return an error that names the plug-ins which ``error``, raised by Numba, is about."""
    names = ", ".join(module.__name__ for module in (*modules[:-1], *modules.stages))
    return EngineError(f"cannot be compiled ({names}): {' '.join(str(error).split())[:600]}")


def _functions(modules: Modules) -> dict[str, Callable[..., Any]]:
    """Return {name in ``loop``: function}."""
    return {
        "plant_init": modules.plant.init,
        "plant_step": modules.plant.step,
        "plant_observe": modules.plant.observe,
        "plant_lumped": modules.plant.lumped,
        "disturbance_sample": modules.disturbance.sample,
        "sensing_step": modules.sensing.step,
        "trajectory_plan": modules.trajectory.plan,
        "trajectory_sample": modules.trajectory.sample,
        "trajectory_duration": modules.trajectory.duration,
        "answer": stages.answer_of(modules.stages),
        "distance_behind": behind_check(modules.stages.position_controller.Internals),
    }


def _bound(modules: Modules, write: Callable[..., Any]) -> Engine:
    functions = _functions(modules)
    return Engine(
        _twin(loop.take_off, "take_off", functions),
        _twin(loop.fly, "fly", {**functions, "LOGGING": False}),
        _twin(loop.fly, "fly_logged", {**functions, "LOGGING": True, "write": write}),
    )


def _twin(function: Callable[..., Any], name: str, scope: Mapping[str, Any]) -> FunctionType:
    """Return a copy of ``function`` with other globals; its name keys it in Numba's file cache."""
    assert isinstance(function, FunctionType)
    twin = FunctionType(function.__code__, {**function.__globals__, **scope}, name)
    twin.__module__ = function.__module__
    twin.__qualname__ = name
    return twin


def _cached(dispatcher: Any, directory: Path) -> Any:
    import numba

    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(directory)
    try:
        dispatcher.enable_caching()
    finally:
        numba.config.CACHE_DIR = before
    return dispatcher

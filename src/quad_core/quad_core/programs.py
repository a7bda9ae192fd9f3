"""The programs of the nodes: which functions of the plug-in contract run on which values."""

from types import ModuleType
from typing import Any

from quad_core.node_parameters import Resolved
from quad_core.plugins import ATTITUDE_LAW, POSITION_LAW
from quad_core.program import Call, Program
from quad_core.types import (
    Actuation,
    AttitudeInputs,
    AttitudeThrust,
    Conditions,
    Disturbance,
    PositionInputs,
    VehicleState,
    Wrench,
)
from quad_core.vehicle import Vehicle

_FLOWN = {POSITION_LAW: (PositionInputs, AttitudeThrust), ATTITUDE_LAW: (AttitudeInputs, Wrench)}


def law(group: str, module: ModuleType) -> Program:
    """Return entry ``step`` of a law: from ``memory``, ``inputs`` and ``dt`` to ``output``, ``next``, ``internals``."""
    inputs, output = _FLOWN[group]
    slots: dict[str, type[Any]] = {
        "parameters": module.Parameters,
        "vehicle": Vehicle,
        "memory": module.Memory,
        "inputs": inputs,
        "dt": float,
        "output": output,
        "next": module.Memory,
        "internals": module.Internals,
    }
    takes = ("parameters", "vehicle", "memory", "inputs", "dt")
    return Program(_name(module), slots, {"step": (Call(module.step, takes, ("output", "next", "internals")),)})


def plant(module: ModuleType) -> Program:
    """Return entries ``advance`` (to the next ``state``, ``truth``, ``actuation``) and ``lumped`` of a plant."""
    slots: dict[str, type[Any]] = {
        "parameters": module.Parameters,
        "vehicle": Vehicle,
        "state": module.State,
        "commanded": Wrench,
        "applied": Wrench,
        "conditions": Conditions,
        "dt": float,
        "actuation": Actuation,
        "truth": VehicleState,
        "disturbance": Disturbance,
    }
    advance = (
        Call(module.step, ("parameters", "vehicle", "state", "applied", "conditions", "dt"), ("state", "actuation")),
        Call(module.observe, ("parameters", "vehicle", "state"), ("truth",)),
    )
    acting = ("parameters", "vehicle", "state", "commanded", "conditions")
    return Program(
        _name(module), slots, {"advance": advance, "lumped": (Call(module.lumped, acting, ("disturbance",)),)}
    )


def of_node(resolved: Resolved) -> Program | None:
    """Return the program that a node runs at every step; None if there is none, or it is not made for Numba."""
    if "law" in resolved.plugins:
        group = POSITION_LAW if resolved.role.endswith("position_controller") else ATTITUDE_LAW
        module = resolved.plugins["law"].module
        program = law(group, module)
    elif "plant" in resolved.plugins:
        module = resolved.plugins["plant"].module
        program = plant(module)
    else:
        return None
    return program if getattr(module, "COMPILES", True) else None


def _name(module: ModuleType) -> str:
    return module.__name__.replace(".", "-")

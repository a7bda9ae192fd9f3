"""When a flight that the guard took over is at its end, and how it is put into words."""

from typing import Any

from quad_core.enumerations import GuardMode
from quad_core.geometry import norm
from quad_core.node_parameters import GuardParameters
from quad_core.types import VehicleState
from quad_guard.guard import REASONS, Memory

STANDING = 0.05  # m above the height of standing, up to which a vehicle is taken to stand


def is_down(parameters: GuardParameters, memory: Memory, truth: VehicleState, has_ground: bool) -> bool:
    """Return whether the vehicle at ``truth`` has come down under the guard.

    On a ground it is down when the backup law has stopped the motors, or, killed, when it lies still below the height
    at which motors may stop; without a ground (``has_ground``) when it passes the height where the ground would be.
    """
    height = truth.p_w.z - parameters.ground_height
    if memory.descent.stopped or not has_ground:
        return memory.descent.stopped or height <= 0.0
    return (
        memory.mode == GuardMode.KILL
        and height <= parameters.contact.stop_height
        and norm(truth.v_w) < parameters.contact.speed
    )


def has_ground(plant: Any) -> bool:
    """Return whether a plant with the parameters ``plant`` has a ground: a field ``ground.enabled`` that is true."""
    ground = getattr(plant, "ground", None)
    return bool(getattr(ground, "enabled", False))


def stands(plant: Any) -> bool:
    """Return whether a plant with the parameters ``plant`` begins standing on its ground."""
    if not has_ground(plant):
        return False
    return bool(plant.initial.p.z - plant.ground.height - plant.ground.foot_depth <= STANDING)


def described(mode: int, reason: int, since: int) -> str:
    """Return mode, reason and step of a takeover in words, empty while the guard passes commands on."""
    name = GuardMode(mode).name.lower()
    return "" if mode == GuardMode.PASS else f"guard in {name} since step {since}: {REASONS[reason]}"

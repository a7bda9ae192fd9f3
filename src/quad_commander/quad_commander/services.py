"""The commander's services, one for each request: `land`, `goto` and so on. `END` lands, disarms, ends the flight."""

import math
from typing import Any

from std_srvs.srv import Trigger

from quad_commander.references import Place
from quad_core.enumerations import Request
from quad_msgs.srv import Goto

SERVICES: dict[Request, Any] = {request: Trigger for request in Request if request} | {Request.GOTO: Goto}
"""{request: type of the service that has its name in lower case}."""


def sender_of(request: Request) -> str:
    """Return the sender of what a service asks for: each has its own, so that none replaces another's request."""
    return f"service {request.name.lower()}"


def place_of(asked: Any) -> Place:
    """Return the place that a FlightRequest or a call of `goto` names."""
    x, y, z = map(float, asked.p_w)
    return Place(x, y, z, None if math.isnan(asked.yaw) else float(asked.yaw))


def is_finite(place: Place) -> bool:
    """Return whether a place is made of finite numbers."""
    return all(map(math.isfinite, (place.x, place.y, place.z, place.yaw or 0.0)))

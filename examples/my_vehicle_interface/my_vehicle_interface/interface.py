"""What the vehicle interface registers: its package, the parameters of its node, its name for scripts/fly."""

from typing import Annotated, NamedTuple

from quad_core.node_parameters import GuardParameters
from quad_core.parameters import Real
from quad_core.roles import VehicleInterface

ROLE = "my_bridge"


class MyBridgeParameters(NamedTuple):
    """The node: what only this vehicle has, and the guard, which every vehicle has."""

    drag: Annotated[float, Real("1/s", "deceleration per speed that the air causes", 0.0, 10.0)] = 0.1
    guard: GuardParameters = GuardParameters()


INTERFACE = VehicleInterface("my_vehicle_interface", MyBridgeParameters, {}, "my_vehicle", "README.md of the package")

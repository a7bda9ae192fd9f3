"""The stages of the loop as names: ``engine.link`` puts the functions of the chosen plug-ins in their place.

Names instead of arguments, because Numba's file cache cannot key compiled functions that are passed as arguments.
Signatures are those of ``quad_core.plugins``.
"""

from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple


def _unbound(*_: Any) -> Any:
    raise RuntimeError("a stage of the loop is not bound; call the loop through quad_campaign.engine")


Stage = Callable[..., Any]

plant_init: Stage = _unbound
plant_step: Stage = _unbound
plant_observe: Stage = _unbound
plant_lumped: Stage = _unbound
disturbance_sample: Stage = _unbound
sensing_step: Stage = _unbound
plan: Stage = _unbound
trajectory_sample: Stage = _unbound
trajectory_duration: Stage = _unbound
position_init: Stage = _unbound
position_step: Stage = _unbound
attitude_init: Stage = _unbound
attitude_step: Stage = _unbound


class Modules(NamedTuple):
    """The plug-in modules of one flight."""

    plant: ModuleType
    disturbance: ModuleType
    trajectory: ModuleType
    position: ModuleType
    attitude: ModuleType
    sensing: ModuleType

    def functions(self) -> dict[str, Stage]:
        """Return {stage name: function}."""
        return {
            "plant_init": self.plant.init,
            "plant_step": self.plant.step,
            "plant_observe": self.plant.observe,
            "plant_lumped": self.plant.lumped,
            "disturbance_sample": self.disturbance.sample,
            "sensing_step": self.sensing.step,
            "plan": self.trajectory.plan,
            "trajectory_sample": self.trajectory.sample,
            "trajectory_duration": self.trajectory.duration,
            "position_init": self.position.init,
            "position_step": self.position.step,
            "attitude_init": self.attitude.init,
            "attitude_step": self.attitude.step,
        }

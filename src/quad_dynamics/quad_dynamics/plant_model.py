"""One plant with its disturbance, stepped from plug-ins; the simulator node is its only clock."""

from quad_core.node_parameters import Resolved
from quad_core.timing import seconds
from quad_core.types import Actuation, Disturbance, Vec3, VehicleState, Wrench


class PlantModel:
    """Holds the plant's state between steps. Step k covers [k, k+1) plant periods."""

    def __init__(self, resolved: Resolved, longest_flight: float) -> None:
        """Draw the disturbance for ``longest_flight`` s and put the plant at its initial state."""
        self._vehicle = resolved.vehicle
        self._period = resolved.flight.plant_period
        self._plant, self._weather = resolved.plugins["plant"], resolved.plugins["disturbance"]
        self._table = self._weather.module.draw(
            self._weather.parameters, self._vehicle, resolved.flight.seed, longest_flight
        )
        self._state = self._plant.module.init(self._plant.parameters, self._vehicle)
        self._wrench = Wrench(0.0, Vec3(0.0, 0.0, 0.0))
        self.actuation = Actuation()
        self.actuated_step = -1
        self.truth = self._observe()

    def disturbance(self, step: int) -> Disturbance:
        """Return what acts over ``step``; the lumped terms are those of the wrench applied last."""
        force_w, torque_b = self._sample(step)
        lumped: Disturbance = self._plant.module.lumped(
            self._plant.parameters, self._vehicle, self._state, self._wrench, force_w, torque_b
        )
        return lumped

    def advance(self, step: int, wrench: Wrench) -> VehicleState:
        """Integrate over ``step`` with ``wrench``; returns the true state at its end."""
        force_w, torque_b = self._sample(step)
        self._wrench = wrench
        self._state, self.actuation = self._plant.module.step(
            self._plant.parameters, self._vehicle, self._state, wrench, force_w, torque_b, seconds(1, self._period)
        )
        self.actuated_step = step
        self.truth = self._observe()
        return self.truth

    def _observe(self) -> VehicleState:
        observed: VehicleState = self._plant.module.observe(self._plant.parameters, self._vehicle, self._state)
        return observed

    def _sample(self, step: int) -> tuple[Vec3, Vec3]:
        time = seconds(step, self._period)
        sampled: tuple[Vec3, Vec3] = self._weather.module.sample(self._weather.parameters, self._table, time)
        return sampled

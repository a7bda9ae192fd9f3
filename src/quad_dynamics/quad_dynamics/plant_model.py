"""The plant with its disturbance, sensors and command link, stepped from plug-ins; the simulator node is its clock."""

from quad_core import programs
from quad_core.machine_code import MachineCode, stepper
from quad_core.node_parameters import Resolved
from quad_core.timing import seconds
from quad_core.types import Actuation, Conditions, Disturbance, VehicleState, Wrench
from quad_dynamics import link

_FIRST_LENGTH = 120.0


class PlantModel:
    """Holds what the plant, its sensors and its link remember between steps. Step k covers [k, k+1) plant periods.

    ``truth`` is the true state, ``state`` what the controllers see of it, ``conditions`` what acts: all of the step
    that comes next. ``actuation`` is that of the last step, ``actuated_step``.
    """

    def __init__(self, resolved: Resolved) -> None:
        """Put the plant at its initial state at step 0; raises ValueError as the plug-ins' ``init`` and ``draw``."""
        self._vehicle, self._seed = resolved.vehicle, resolved.flight.seed
        self._period = resolved.flight.plant_period
        self._dt = seconds(1, self._period)
        self._plant, self._weather, self._sensing = (
            resolved.plugins[slot] for slot in ("plant", "disturbance", "sensing")
        )
        start = {
            "parameters": self._plant.parameters,
            "vehicle": self._vehicle,
            "state": self._plant.module.init(self._plant.parameters, self._vehicle),
            "commanded": Wrench(),
            "dt": self._dt,
        }
        self._stepper = stepper(programs.plant(self._plant.module), resolved.flight.machine_code, start)
        self.truth: VehicleState = self._plant.module.observe(
            self._plant.parameters, self._vehicle, self._stepper.get("state")
        )
        self._sensing_line, self._sensing_memory = self._sensing.module.init(self._sensing.parameters, self._period)
        self._link_line, self._link_memory = link.init()
        self._applied = Wrench()
        self.actuation = Actuation()
        self.actuated_step = -1
        self.cover(round(_FIRST_LENGTH / self._dt))
        self._look(0)

    def cover(self, steps: int) -> None:
        """Draw what is random for a flight of ``steps`` plant steps; what was drawn for its beginning stays."""
        self._covered = steps
        self._table = self._weather.module.draw(
            self._weather.parameters, self._vehicle, self._seed, seconds(steps, self._period)
        )
        self._noise = self._sensing.module.draw(self._sensing.parameters, self._seed, steps)

    def disturbance(self) -> Disturbance:
        """Return what acts over the coming step; the lumped terms are those of the wrench commanded last."""
        self._stepper.run("lumped")
        lumped: Disturbance = self._stepper.get("disturbance")
        return lumped

    @property
    def machine_code(self) -> int:
        """1 if the plant is run as machine code, else 0."""
        return int(isinstance(self._stepper, MachineCode))

    def announcements(self) -> list[tuple[float, str, str]]:
        """Return (time s, kind, text) of what the disturbance has to report in flight, in order of time."""
        announce = getattr(self._weather.module, "announcements", None)
        found: list[tuple[float, str, str]] = announce(self._weather.parameters) if announce else []
        return found

    def advance(self, step: int, wrench: Wrench) -> VehicleState:
        """Integrate over ``step`` with the command ``wrench``; returns the true state at its end."""
        self._applied, self._link_memory = link.step(
            self._link_line, self._link_memory, self.conditions.link, wrench, self._applied, step, self._dt
        )
        self._stepper.put("commanded", wrench)
        self._stepper.put("applied", self._applied)
        self._stepper.run("advance")
        self.truth, self.actuation = self._stepper.get("truth"), self._stepper.get("actuation")
        self.actuated_step = step
        if step + 1 >= self._covered:
            self.cover(2 * self._covered)
        self._look(step + 1)
        return self.truth

    def _look(self, step: int) -> None:
        self.conditions: Conditions = self._weather.module.sample(
            self._weather.parameters, self._table, seconds(step, self._period)
        )
        self._stepper.put("conditions", self.conditions)
        self.state: VehicleState
        self.state, self._sensing_memory = self._sensing.module.step(
            self._sensing.parameters,
            self._noise,
            self._sensing_line,
            self._sensing_memory,
            self.truth,
            self.conditions.sensor,
            step,
        )

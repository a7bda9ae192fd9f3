"""The plant with its disturbance, sensors and command link, stepped from plug-ins; the simulator node is its clock."""

from quad_core.cycle import seconds
from quad_core.lift_off import airborne, lifted_off, marked, standing
from quad_core.resolution import Resolved
from quad_core.types import Actuation, Conditions, Disturbance, VehicleState, Wrench
from quad_dynamics import link
from quad_guard.ending import has_ground, stands

_FIRST_LENGTH = 120.0


class PlantModel:
    """Holds what the plant, its sensors and its link remember between steps. Step k covers [k, k+1) plant periods.

    ``truth`` is the true state, ``state`` what the controllers see of it, ``conditions`` what acts: all of the step
    that comes next. ``lift`` marks the state while ``armed`` says whether the motors may turn.
    ``actuation`` is that of the last step, ``actuated_step``. ``step`` and ``lumped`` are the plant's
    functions.
    """

    def __init__(self, resolved: Resolved) -> None:
        """Put the plant at its initial state at step 0; raises ValueError as the plug-ins' ``init`` and ``draw``."""
        self._vehicle, self._seed = resolved.vehicle, resolved.flight.seed
        self._period = resolved.flight.plant_period
        self._dt = seconds(1, self._period)
        self._plant, self._weather, self._sensing = (
            resolved.plugins[slot] for slot in ("plant", "disturbance", "sensing")
        )
        module = self._plant.module
        self.step, self.lumped = module.step, module.lumped
        self._state = module.init(self._plant.parameters, self._vehicle)
        self._commanded = Wrench()
        self.truth: VehicleState = module.observe(self._plant.parameters, self._vehicle, self._state)
        self._sensing_line, self._sensing_memory = self._sensing.module.init(self._sensing.parameters, self._period)
        self._link_line, self._link_memory = link.init()
        self._applied = Wrench()
        self._sent_steps = [-1] * link.SLOTS
        self.lift, self.armed = airborne(0.0), True
        self.state: VehicleState = self.truth
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
        found: Disturbance = self.lumped(
            self._plant.parameters, self._vehicle, self._state, self._commanded, self.conditions
        )
        return found

    def announcements(self) -> list[tuple[float, str, str]]:
        """Return (time s, kind, text) of what the disturbance has to report in flight, in order of time."""
        announce = getattr(self._weather.module, "announcements", None)
        found: list[tuple[float, str, str]] = announce(self._weather.parameters) if announce else []
        return found

    def stand(self, ground_height: float) -> None:
        """Begin on the ground if the plant stands there, else in the air above a ground at ``ground_height`` m."""
        self.lift = standing(self.state.p_w.z) if stands(self._plant.parameters) else airborne(ground_height)
        self.state = marked(self.state, self.lift)

    @property
    def has_ground(self) -> bool:
        """Whether the plant has a ground on which the vehicle can come to rest."""
        return has_ground(self._plant.parameters)

    def receive(self, step: int, wrench: Wrench, command_step: int) -> tuple[Wrench, int]:
        """Return the wrench that comes through the command link at ``step``, and the step of the state it answers.

        ``wrench`` is what is sent at ``step``, the answer to the state of ``command_step``; -1: none has come yet.
        """
        fault = self.conditions.link
        self._commanded = wrench
        self._sent_steps[step % link.SLOTS] = command_step
        self._applied, self._link_memory = link.step(
            self._link_line, self._link_memory, fault, wrench, self._applied, step, self._dt
        )
        if fault.delay <= 0.0 and not fault.lost:
            return self._applied, command_step
        sent = self._link_memory.applied
        return self._applied, self._sent_steps[sent % link.SLOTS] if sent >= 0 else -1

    def advance(self, step: int, wrench: Wrench) -> VehicleState:
        """Integrate over ``step`` with ``wrench`` for the rotors; returns the true state at its end."""
        plant, vehicle = self._plant.parameters, self._vehicle
        self._state, self.actuation = self.step(plant, vehicle, self._state, wrench, self.conditions, self._dt)
        self.truth = self._plant.module.observe(plant, vehicle, self._state)
        self.actuated_step = step
        if step + 1 >= self._covered:
            self.cover(2 * self._covered)
        self._look(step + 1)
        return self.truth

    def _look(self, step: int) -> None:
        self.conditions: Conditions = self._weather.module.sample(
            self._weather.parameters, self._table, seconds(step, self._period)
        )
        self.state, self._sensing_memory = self._sensing.module.step(
            self._sensing.parameters,
            self._noise,
            self._sensing_line,
            self._sensing_memory,
            self.truth,
            self.conditions.sensor,
            step,
        )
        if self.lift.on_ground or self.lift.ground_z != 0.0 or not self.armed:
            self.lift = lifted_off(self.lift, self.state, self.armed, self._dt)
            self.state = marked(self.state, self.lift)

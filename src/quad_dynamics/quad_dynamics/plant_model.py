"""The plant with its disturbance, sensors and command link, stepped from plug-ins; the simulator node is its clock."""

from collections import deque
from collections.abc import Iterator

from quad_core.cycle import seconds
from quad_core.lift_off import airborne, standing
from quad_core.resolution import Resolved
from quad_core.types import Actuation, Conditions, Disturbance, VehicleState, Wrench, with_ground
from quad_dynamics.simulated_vehicle import (
    Memory,
    RandomStreams,
    SimulatedVehicle,
    link_init,
    receive,
    sensing_is_active,
    vehicle_functions,
)
from quad_guard.checks import WrenchCommand
from quad_guard.ending import has_ground, stands

_FIRST_LENGTH = 120.0


class PlantModel:
    """What the ``simulated_vehicle`` remembers between steps. Step k covers [k, k+1) plant periods.

    ``truth`` is the true state, ``state`` what the controllers see of it, ``conditions`` what acts: all of the step
    that comes next. ``armed``: the motors may turn. ``actuated_step``: the step of ``actuation``.
    """

    def __init__(self, resolved: Resolved) -> None:
        """Put the plant at its initial state at step 0; raises ValueError as the plug-ins' ``init`` and ``draw``."""
        plant, weather, sensing = (resolved.plugins[slot] for slot in ("plant", "disturbance", "sensing"))
        self._plant, self._weather, self._sensing = plant, weather, sensing
        self._seed, period = resolved.flight.seed, resolved.flight.plant_period
        self._side = SimulatedVehicle(resolved.vehicle, period, *(one.parameters for one in (plant, weather, sensing)))
        self._do = vehicle_functions(plant.module, sensing.module)
        self._sensing_line, sensed = sensing.module.init(sensing.parameters, period)
        self._link_line, linked = link_init()
        self._commanded = Wrench()
        announcements = getattr(weather.module, "announcements", None)
        self._announcements = deque[tuple[float, str, str]](announcements(weather.parameters) if announcements else [])
        self.truth: VehicleState
        self.state: VehicleState
        self.conditions: Conditions
        self._memory: Memory
        self._memory = self._do.begin(self._side, sensed, linked)
        self.truth = self._do.observe(self._side, self._memory)
        self.armed, self.actuated_step = True, -1
        self.cover(round(_FIRST_LENGTH / seconds(1, period)))
        self._look(0)

    def cover(self, steps: int) -> None:
        """Draw what is random for a flight of ``steps`` plant steps; what was drawn for its beginning stays."""
        self._covered, side = steps, self._side
        weather = self._weather.module.draw(side.disturbance, side.vehicle, self._seed, seconds(steps, side.period))
        noise = self._sensing.module.draw(side.sensing, self._seed, steps)
        self._drawn = RandomStreams(weather, noise, self._sensing_line, self._link_line)

    @property
    def actuation(self) -> Actuation:
        """What the rotors made of the last wrench."""
        return self._memory.actuation

    def disturbance(self) -> Disturbance:
        """Return what acts over the coming step; the lumped terms are those of the wrench commanded last."""
        side = self._side
        found: Disturbance = self._plant.module.lumped(
            side.plant, side.vehicle, self._memory.plant, self._commanded, self.conditions
        )
        return found

    def announced(self, step: int) -> Iterator[tuple[str, str]]:
        """Yield kind and text of what the disturbance has to report up to ``step``, each once, in order of time."""
        now = seconds(step, self._side.period)
        while self._announcements and self._announcements[0][0] <= now:
            yield self._announcements.popleft()[1:]

    def stand(self, ground_height: float) -> None:
        """Begin on the ground if the plant stands there, else in the air above a ground at ``ground_height`` m."""
        lift = standing(self.state.p_w.z) if stands(self._plant.parameters) else airborne(ground_height)
        self._memory = self._memory._replace(lift=lift)
        self.state = with_ground(self.state, lift.ground_z, lift.on_ground)

    @property
    def has_ground(self) -> bool:
        """Whether the plant has a ground on which the vehicle can come to rest."""
        return has_ground(self._plant.parameters)

    def receive(self, step: int, wrench: Wrench, answers: int) -> WrenchCommand:
        """Return what comes through the command link at ``step``.

        ``wrench`` is what is sent at ``step``; it answers the state of step ``answers``.
        """
        self._commanded = wrench
        found, self._memory = receive(self._side, self._drawn, self._memory, self.conditions, wrench, answers, step)
        return found

    def advance(self, step: int, wrench: Wrench) -> VehicleState:
        """Integrate over ``step`` with ``wrench`` for the rotors; returns the true state at its end."""
        self._memory = self._do.move(self._side, self._memory, self.conditions, wrench)
        self.truth = self._do.observe(self._side, self._memory)
        self.actuated_step = step
        if step + 1 >= self._covered:
            self.cover(2 * self._covered)
        self._look(step + 1)
        return self.truth

    def _look(self, step: int) -> None:
        side, drawn = self._side, self._drawn
        self.conditions = self._weather.module.sample(side.disturbance, drawn.weather, seconds(step, side.period))
        self.state = self.truth
        if not self.armed or sensing_is_active(self._memory, self.conditions):
            seen = self._do.sense(side, drawn, self._memory, self.truth, self.conditions, self.armed, step)
            self.state, self._memory = seen

"""All sensors of a vehicle, one plant step after the other: when each is read, and what goes over the wire."""

from collections import deque
from typing import NamedTuple

from quad_core.cycle import seconds
from quad_core.parameters import ParameterError
from quad_core.types import Vec3, VehicleState
from quad_mavlink.hil import earth, messages, sensors
from quad_mavlink.hil.parameters import JoinedPlantParameters

_MICROSECOND = 1000


class Reading(NamedTuple):
    """What is sent for one step; GPS and truth only where they are due."""

    sensor: messages.Fields
    gps: messages.Fields | None
    truth: messages.Fields | None


class Suite:
    """Reads the sensors at every step of its own clock, which begins one period after 0 and never stands still.

    ``time_usec`` is the time of the last reading in us.
    """

    def __init__(self, parameters: JoinedPlantParameters, seed: int, plant_period: int, gravity: float) -> None:
        """Draw the first biases; ``plant_period`` in ns, a whole number of us, or ParameterError is raised."""
        if plant_period % _MICROSECOND:
            raise ParameterError(f"flight.plant_period: found {plant_period} ns, expected whole microseconds")
        self.time_usec = 0
        self._parameters, self._seed, self._gravity = parameters, seed, gravity
        self._period, self._dt = plant_period, seconds(1, plant_period)
        self._count = 0
        self._table = sensors.draw(seed, 0)
        self._memory = sensors.init(parameters, self._table[0])
        late = round(1e9 * parameters.gps.delay / plant_period)
        self._past: deque[VehicleState] = deque(maxlen=late + 1)
        self._before: VehicleState | None = None

    def read(self, truth: VehicleState, wind_w: Vec3) -> Reading:
        """Return what the sensors read of ``truth``, one period after the last reading; ``wind_w`` in m/s."""
        parameters, dt = self._parameters, self._dt
        self._count += 1
        self.time_usec = self._count * self._period // _MICROSECOND
        if self._count % sensors.BLOCK == 0:
            self._table = sensors.draw(self._seed, self._count // sensors.BLOCK)
        row = self._table[self._count % sensors.BLOCK]
        self._past.append(truth)
        before, self._before = self._before or truth, truth
        inertial, self._memory = sensors.inertial(parameters, self._memory, before, truth, self._gravity, dt, row)
        field, air, fix = None, None, None
        if self._is_due(parameters.magnetometer.period_steps):
            since = dt * parameters.magnetometer.period_steps
            field, self._memory = sensors.compass(parameters, self._memory, truth.q_wb, since, row)
        if self._is_due(parameters.barometer.period_steps):
            time = seconds(self._count, self._period)
            air = sensors.air(parameters.barometer, parameters.home, truth.p_w.z, time, row)
        if self._is_due(parameters.gps.period_steps):
            since, late = dt * parameters.gps.period_steps, self._past[0]
            fix, self._memory = sensors.fix(parameters.gps, parameters.home, self._memory, late, since, row)
        true = None
        if self._is_due(parameters.truth_period_steps):
            place = earth.place(parameters.home, truth.p_w)
            true = messages.truth(self.time_usec, truth, place, wind_w, inertial.force)
        return Reading(
            messages.sensor(self.time_usec, inertial, field, air),
            messages.gps(self.time_usec, fix) if fix else None,
            true,
        )

    def _is_due(self, period_steps: int) -> bool:
        return self._count % period_steps == 0

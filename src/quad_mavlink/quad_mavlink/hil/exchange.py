"""One step of lockstep: sensors out, motors back. The clock is ours, and it goes on only with an answer.

While an autopilot boots it answers nothing, but needs a clock that runs: until its first answer the sensors are sent at
the pace of the steady clock, and the vehicle rests.
"""

import time
from types import ModuleType
from typing import Any

from quad_core.types import Vec3, VehicleState
from quad_mavlink.hil import motors
from quad_mavlink.hil.suite import Suite
from quad_mavlink.link import Server

_CONTROLS = "HIL_ACTUATOR_CONTROLS"


class RefusedError(ValueError):
    """An answer that cannot be flown; the text names field, found and expected."""


class Exchange:
    """Sends what the sensors read, and takes the answer to it; ``stale`` answers were for earlier readings."""

    def __init__(self, mavlink: ModuleType, server: Server, suite: Suite) -> None:
        """Speak through ``server``."""
        self._mavlink, self.server, self.suite = mavlink, server, suite
        self.stale = 0
        self._due = 0.0

    def send(self, truth: VehicleState, wind_w: Vec3) -> None:
        """Read the sensors and send them."""
        reading = self.suite.read(truth, wind_w)
        out: list[Any] = []
        if reading.truth is not None:
            out.append(self._mavlink.MAVLink_hil_state_quaternion_message(*reading.truth))
        if reading.gps is not None:
            out.append(self._mavlink.MAVLink_hil_gps_message(*reading.gps))
        # last: it moves the autopilot's clock
        out.append(self._mavlink.MAVLink_hil_sensor_message(*reading.sensor))
        self.server.send(out)

    def answer(self, patience: float, newest: bool = False) -> motors.Answer | None:
        """Return the answer to the last reading, None if none comes within ``patience`` s; raises RefusedError.

        ``newest``: whatever outputs come count, those for an earlier reading too.
        """
        while True:
            message = self.server.next(_CONTROLS, patience)
            if message is None:
                return None
            first, second, third, fourth = message.controls[: motors.MOTORS]
            found = motors.Answer(message.time_usec, (first, second, third, fourth), message.mode, message.flags)
            if refused := motors.refusal(found, self.suite.time_usec):
                raise RefusedError(refused)
            if newest or found.time_usec == self.suite.time_usec:
                return found
            self.stale += 1

    def newest(self, patience: float) -> motors.Answer | None:
        """Return the newest outputs, whatever they answer; None if none come in ``patience`` s; raises RefusedError."""
        found = self.answer(patience, newest=True)
        while found is not None and (later := self.answer(0.0, newest=True)) is not None:
            found = later
        return found

    def boot(self, truth: VehicleState, wind_w: Vec3, period: float, until: float) -> motors.Answer | None:
        """Send readings every ``period`` s until the steady time ``until`` s; return the first answer if it comes."""
        while not self.server.is_closed and (now := time.monotonic()) < until:
            self._due = max(self._due + period, now)
            self.send(truth, wind_w)
            found = self.answer(max(self._due - time.monotonic(), 0.0))
            if found is not None:
                return found
        return None

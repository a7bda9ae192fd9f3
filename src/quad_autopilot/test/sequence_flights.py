"""The arming sequence beside an autopilot of a few lines that may refuse, be late, or be taken away."""

import math

from quad_autopilot import arming
from quad_autopilot.autopilot import DO_SET_MODE, Ack, Autopilot, Control, Profile, Request
from quad_autopilot.evidence import Inputs, Memory, Phase
from quad_autopilot.parameters import ArmingParameters

TICK = 0.02
PARAMETERS = ArmingParameters()
MODE, ARM, LAND = 176, 400, 21
UNSAID = -1  # a mode that is not ours and has no name yet
PROFILE = Profile(
    "PX4", "offboard", "vehicle_status", "vehicle_odometry", "where is its agent?", Request(DO_SET_MODE, 1.0, 6.0)
)
OURS = {
    14: Control.OURS, 18: Control.LANDING, 17: Control.CLIMBING, 4: Control.WAITING, UNSAID: Control.UNSAID,
}  # fmt: skip
NAMES = {2: "POSCTL", 15: "STAB", 18: "AUTO_LAND"}


def said(nav_state, arming_state, failsafe=False, checks_pass=True, reasons=(), **more):
    """Return what an autopilot in a mode says, by PX4's numbers."""
    name, control = NAMES.get(nav_state, f"mode {nav_state}"), OURS.get(nav_state, Control.OTHER)
    return Autopilot(name, control, arming_state == 2, failsafe, checks_pass, reasons, **more)


class Flight:
    """Runs the sequence beside a simple autopilot, which obeys after two ticks unless an option says otherwise."""

    def __init__(self, **px4):
        self.now, self.autopilot_time = 100.0, 7.0
        self.nav_state, self.arming_state, self.silent = 4, 1, False
        self.results = {}  # {command: result}
        self.lost, self.deaf, self.reasons, self.failsafe = set(), set(), (), False
        self.profile, self.loss_timeout, self.beat_at = PROFILE, None, math.nan
        self.inputs = {"command_age": 0.0, "state_age": 0.0}
        self.memory, self.output, self.requests, self.phases, self.due = Memory(), None, [], [], []
        for name, value in px4.items():
            setattr(self, name, value)

    def obey(self, request):
        result = self.results.get(request.command, 0)
        if request.command in self.deaf:
            return None
        if result == 0:
            if request.command == MODE:
                self.nav_state = 4 if request.param3 == 3.0 else 14
            elif request.command == ARM:
                self.arming_state = 2
            else:
                self.nav_state = 18
        return None if request.command in self.lost else Ack(request.command, result)

    def stream(self):
        """Return what the autopilot says of our stream, with the time of the loss; nothing unless it is asked."""
        if self.loss_timeout is None:
            return {}
        lost_at = self.beat_at + self.loss_timeout
        return {"stream_lost": not self.autopilot_time < lost_at, "lost_at": lost_at}

    def tick(self, **inputs):
        told = said(self.nav_state, self.arming_state, self.failsafe, True, self.reasons, **self.stream())
        autopilot = None if self.silent else told
        ack = None
        if self.due and self.due[0][0] <= self.now:
            ack = self.obey(self.due.pop(0)[1])
        given = Inputs(self.now, self.autopilot_time, autopilot, ack, **{**self.inputs, **inputs})
        self.output, self.memory = arming.step(self.profile, PARAMETERS, self.memory, given)
        self.beat_at = self.autopilot_time if self.output.heartbeat else self.beat_at
        if self.output.request:
            self.requests.append((self.now, self.output.request))
            self.due.append((self.now + 2 * TICK, self.output.request))
        if not self.phases or self.phases[-1] != self.output.phase:
            self.phases.append(self.output.phase)
        self.now += TICK
        self.autopilot_time += TICK
        return self.output

    def run(self, until, longest=30.0, **inputs):
        end = self.now + longest
        while self.tick(**inputs).phase != until:
            assert self.now < end, (self.output, self.memory)
        return self.output


def flying(**px4):
    flight = Flight(**px4)
    flight.run(Phase.FLY)
    return flight


def asked(flight):
    return [request.command for _, request in flight.requests]

"""`ros2 run quad_dynamics check_plant`: plays the attitude controller and names what a plant breaks of the contract."""

import math
import sys
import time

from quad_core.cascade import COMMAND, COMMANDING, SIMULATOR
from quad_core.cycle import steps_to_cover
from quad_core.types import Vec3, VehicleState, Wrench
from quad_dynamics.check_plant.rules import Manoeuvre, Report, Rules, manoeuvres
from quad_msgs.msg import Actuation as ActuationMsg
from quad_msgs.msg import FlightPlan, FlightState, NodeStatus
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node.codec import head_of, pack_wrench, unpacker
from quad_node.conversion import set_stamp
from quad_node.flight_node import FlightNode
from quad_node.handshake import Handshake, is_foreign
from quad_node.interface import interface_hash
from quad_node.main import run

ROLES = f"{SIMULATOR},{COMMANDING}"
HELP = f"""Check a plant or bridge against docs/how_to/swap_the_plant.md, as the only other node of its flight.

usage: ros2 run quad_dynamics check_plant [--ros-args -p flight.mode:=realtime -p vehicle.mass:=0.56 ...]

Start the plant with the same vehicle and `flight.roles:={ROLES}`, high enough to move by a metre:
  ros2 run quad_dynamics simulator --ros-args -p flight.roles:={ROLES} -p flight.run_id:=check -p disturbance:=none &
  ros2 run quad_dynamics check_plant --ros-args -p flight.run_id:=check

It answers states with short manoeuvres (climb, one doublet of torque about each axis), then falls silent.
HARDWARE: only without propellers. Takes every flight.* and vehicle.* parameter.
Exit code: 0 kept, 1 broken, 2 bad usage."""

_STILL = 0.3
_PROBES = (
    "the plant waits for the answer to its state",
    "a command for another step is ignored",
    "a command that is not finite is ignored",
)
_SILENT = "a silent controller ends the flight as FAILED, named"
_GOES_ON = "the vehicle goes on once its state is answered"
_READY = "the vehicle says READY on flight/nodes"
_FITS = "the vehicle on flight/nodes fits the flight"
_ANSWER, _END, _LONGEST = 10.0, 30.0, 200.0  # s: the next step, the end of a silent flight, the whole check
_SILENCE = 3.0  # s; flight/state comes once a second


class PlantCheck(FlightNode):
    """Answers `state` with manoeuvres; first it withholds answers, last it falls silent.

    At any time one thing is expected of the vehicle. What does not come in time is the broken rule, and ends the check.
    """

    def __init__(self, report: Report) -> None:
        """Subscribe to state, actuation and flight/nodes; raises as FlightNode."""
        self._report, self._left = report, list[Manoeuvre]()
        super().__init__(COMMANDING)
        self._rules, self._ready, self._flown = Rules(report, self.flight), False, False
        self._handshake = Handshake(self.flight, interface_hash(), [SIMULATOR])
        self._read = unpacker(VehicleState, VehicleStateMsg)
        self._plan_out, self._wrench_out = self.publisher("flight/plan"), self.publisher(COMMAND)
        self._left = manoeuvres(self.vehicle)
        self._until, self._before = 0, VehicleState()
        self._probe, self._probed = list(_PROBES) if self.lockstep else [], 0.0
        self._waiting = ""
        self._expect("the vehicle sends and takes what it must, and says READY", self.flight.start_timeout)
        self.subscribe("state", self._on_state, depth=64, raw=True)
        self.subscribe("actuation", self._on_actuation, depth=64)
        self.subscribe("flight/nodes", self._on_node, depth=64)

    def _expect(self, rule: str, patience: float) -> None:
        self._expected, self._patience, self._deadline = rule, patience, time.monotonic() + patience

    def _watch_flight(self) -> None:
        """Leave the time limits to ``on_tick``, which names the rule."""

    def _on_node(self, message: NodeStatus) -> None:
        problem = self._handshake.on_status(message)
        if problem and self._rules.last is None:
            self._break(_FITS, problem)
        if not self._handshake.missing() and not self._ready:
            self._ready = True
            if self._rules.last is None:
                self._expect("the vehicle sends state 0 once all are READY", _ANSWER)

    def _on_flight_state(self, message: FlightState) -> None:
        if not is_foreign(message.run_id, self.flight.run_id):
            self._flown = self._flown or message.state == FlightState.FLYING
            self._waiting = message.reason if message.state == FlightState.WAITING else ""
        super()._on_flight_state(message)

    def _on_actuation(self, message: ActuationMsg) -> None:
        self._check_run("actuation", message.run)
        self._rules.actuation(message.step, (message.thrust, *message.torque_b))

    def _on_state(self, payload: bytes) -> None:
        step, _, stamp, state, _ = self._read(payload)
        self._check_run("state", head_of(payload)[1])
        self.flying = True
        if self._rules.last is None:
            self._first(state, step)
        if self._rules.state(state, step, stamp):
            return
        if self._probe and step > 0:
            self._report.add(self._probe[0], f"the plant went on to step {step}")
            self._probe.clear()
        if not self._probe:
            self._answer(state, step)

    def _check_run(self, topic: str, found: int) -> None:
        if self.flight.run_id:
            wrong = f"{topic}: found {found}, expected {self.run}" if found != self.run else ""
            self._report.add("run of state and actuation is the CRC-32 of flight.run_id", wrong)

    def _first(self, state: VehicleState, step: int) -> None:
        self._before = state
        steps = sum(steps_to_cover(part.duration, self.flight.plant_period) for part in self._left)
        plan = FlightPlan(trajectory="check_plant", start="printed", end_step=step + 2 * steps + 100_000, run=self.run)
        set_stamp(plan.end, plan.end_step * self.flight.plant_period)
        self._plan_out.publish(plan)
        self._probed = time.monotonic()
        self._expect(self._probe[0] if self._probe else "the state goes on", _ANSWER)

    def on_tick(self) -> None:
        """Go on after a probe that the plant withstood; end what does not go on."""
        now = time.monotonic()
        if self._rules.last and self._probe and self._probed and now - self._probed >= _STILL:
            self._next_probe(*self._rules.last)
        if self.done.done():
            return
        quiet = now - self.last_heard
        if self._flown and quiet > _SILENCE:
            self._break("flight/state comes once a second", f"nothing for {quiet:.1f} s")
        elif now > self._deadline:
            waiting = f"; the vehicle says: {self._waiting}" if self._waiting else ""
            found = ", ".join(self.missing_links())
            links = f"; not matched: {found}" if found else ""
            others = self._handshake.foreign_nodes()
            self._break(self._expected, f"not within {self._patience:g} s{waiting}{links}{others}")
        elif now - self.started > _LONGEST + self.flight.start_timeout:
            self._break("a check is over in time", f"the manoeuvres take longer than {_LONGEST:g} s")

    def _next_probe(self, step: int, state: VehicleState) -> None:
        """Lockstep: send what must not move the plant, or after the last probe the first answer."""
        self._report.add(self._probe.pop(0))
        self._expect(_GOES_ON, _ANSWER)
        self._probed = time.monotonic()
        if not self._probe:
            self._answer(state, step)
        elif self._probe[0] == _PROBES[1]:
            self._send(Wrench(self.vehicle.mass * self.vehicle.gravity, Vec3()), step + 3)
        else:
            self._send(Wrench(math.nan, Vec3()), step)

    def _break(self, rule: str, problem: str) -> None:
        self._report.add(rule, problem)
        self.finish(1, f"{rule}: {problem}")

    def _answer(self, state: VehicleState, step: int) -> None:
        if step >= self._until and self._until and self._left:
            done = self._left.pop(0)
            self._report.add(done.name, done.problem(self._before, state))
            self._until = 0
            if not self._left:
                self._rules.flight()
                self._report.add(_READY, "" if self._ready else f"it never did{self._handshake.foreign_nodes()}")
                self._report.add("flight/state is FLYING while states are sent", "" if self._flown else "it never was")
                self._expect(_SILENT, _END)
        if not self._left:
            return
        self._expect(_GOES_ON, _ANSWER)
        if not self._until:
            self._before = state
            self._until = step + steps_to_cover(self._left[0].duration, self.flight.plant_period)
        self._send(self._left[0].wrench, step)

    def _send(self, wrench: Wrench, step: int) -> None:
        self._wrench_out.publish(pack_wrench(wrench, step * self.flight.plant_period))

    def on_flight_ended(self, message: FlightState) -> None:
        """Check how the plant takes silence, and leave."""
        if self._left:
            self._report.add(self._expected, f"the vehicle ended the flight before: {message.reason}")
        named = COMMAND in message.reason or COMMANDING in message.reason
        failed = message.state == FlightState.FAILED
        wrong = "" if failed and named else f"flight/state {message.state}, reason {message.reason!r}"
        self._report.add(_SILENT, wrong)
        self.finish(0, "checked")


def main() -> None:
    """Run the check and print what was found."""
    if "--help" in sys.argv or "-h" in sys.argv:
        sys.stdout.write(HELP + "\n")
        sys.exit(0)
    report = Report()
    code = run(COMMANDING, lambda: PlantCheck(report), "", [*sys.argv, "--ros-args", "-p", f"flight.roles:={ROLES}"])
    if code == 2:
        sys.exit(2)
    if code == 1 and not report.broken:
        report.add("a flight", "none was flown to its end: see the messages above")
    sys.stdout.write(report.text() + "\n")
    sys.exit(1 if report.broken else 0)

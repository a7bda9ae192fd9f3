"""`ros2 run quad_dynamics check_plant`: plays the attitude controller and names what a vehicle does wrongly."""

import sys
import time

from quad_core.cascade import COMMAND, COMMANDING, SIMULATOR
from quad_core.cycle import is_flyable, steps_to_cover
from quad_core.types import VehicleState
from quad_dynamics.manoeuvres import manoeuvres, report
from quad_msgs.msg import FlightPlan, FlightState
from quad_msgs.msg import VehicleState as VehicleStateMsg
from quad_node.codec import UNUSABLE, pack_wrench, set_stamp, unpacker
from quad_node.flight_node import FlightNode
from quad_node.main import run

ROLES = f"{SIMULATOR},{COMMANDING}"
HELP = f"""Check what a plant or bridge makes of a wrench, as the only other node of its flight.

usage: ros2 run quad_dynamics check_plant [--ros-args -p flight.mode:=realtime -p vehicle.mass:=0.56 ...]

Start the plant with the same vehicle and `flight.roles:={ROLES}`, high enough to move by a metre:
  ros2 run quad_dynamics simulator --ros-args -p flight.roles:={ROLES} -p flight.run_id:=check -p disturbance:=none &
  ros2 run quad_dynamics check_plant --ros-args -p flight.run_id:=check

It answers states with short manoeuvres (climb, one doublet of torque about each axis), then falls silent.
HARDWARE: only without propellers. Takes every flight.* and vehicle.* parameter.
Exit code: 0 kept, 1 broken, 2 bad usage."""

_START = "the vehicle sends its first state once all are READY"
_SILENT = "a silent controller ends the flight as FAILED, named"
_ANSWER, _END = 10.0, 30.0  # s of wall time from one state to the next, in a manoeuvre and at the silent end


class PlantCheck:
    """Answers `state` with manoeuvres, then falls silent. What does not come in time is broken, and ends the check."""

    def __init__(self, found: dict[str, str]) -> None:
        """Subscribe to state; ``found`` gets {rule: what is wrong with it}. Raises as FlightNode."""
        self.node = node = FlightNode(COMMANDING, watch=self._watch, deactivate=self.deactivate)
        self._found, self._left = found, manoeuvres(node.vehicle)
        self._before: VehicleState | None = None
        self._until = self._newest = 0
        self._read = unpacker(VehicleState, VehicleStateMsg, run=node.run)
        self._plan_out, self._wrench_out = node.links.publisher("flight/plan"), node.links.publisher(COMMAND)
        node.links.subscribe("state", self.step, depth=64, raw=True)
        node.links.subscribe("actuation", lambda _: None, raw=True)  # a vehicle begins once a node reads it
        self._expect(_START, node.flight.start_timeout)

    def _expect(self, rule: str, patience: float) -> None:
        self._expected, self._patience, self._deadline = rule, patience, time.monotonic() + patience

    def step(self, payload: bytes) -> None:
        """Judge a state, and answer it with the wrench of the manoeuvre that it belongs to."""
        try:
            stamped = self._read(payload)
        except UNUSABLE as error:
            self.node.events.unusable("state", payload, error)
            return
        state, step = stamped.value, stamped.step
        if step > self._newest:  # on a busy machine a manoeuvre takes as long as it takes
            self._newest, self._deadline = step, time.monotonic() + self._patience
        if not self._left:
            if step > self._until:
                self._break(f"not within {_END:g} s of the flight")
            return
        if not (stamped.finite and is_flyable(state)):
            self._break(f"step {step} has {state}, expected finite numbers, in bounds, a quaternion of length 1")
            return
        if self._before is None:
            self._found[_START] = ""
            self._plan(step)
        elif step >= self._until:
            done = self._left.pop(0)
            self._found[done.name] = done.problem(self._before, state)
        if not self._left:
            self._until = step + steps_to_cover(_END, self.node.flight.plant_period)
            self._expect(_SILENT, _END)
            return
        part = self._left[0]
        if self._before is None or step >= self._until:
            self._before, self._until = state, step + steps_to_cover(part.duration, self.node.flight.plant_period)
            self._expect(part.name, _ANSWER)
        self._wrench_out.publish(pack_wrench(part.wrench, step * self.node.flight.plant_period))

    def _plan(self, step: int) -> None:
        period, run_number = self.node.flight.plant_period, self.node.run
        end_step = step + 2 * sum(steps_to_cover(part.duration, period) for part in self._left) + 100_000
        plan = FlightPlan(trajectory="check_plant", start="printed", end_step=end_step, run=run_number)
        set_stamp(plan.end, end_step * period)
        self._plan_out.publish(plan)

    def _watch(self) -> None:
        """End what does not go on, and name the rule."""
        node, now = self.node, time.monotonic()
        if not node.done.done() and now > self._deadline:
            missing = ", ".join(node.missing())
            self._break(f"not within {self._patience:g} s{f'; not matched: {missing}' if missing else ''}")
        node.last_heard = now  # the time limits are those of the rules

    def _break(self, problem: str) -> None:
        self._found[self._expected] = problem
        self.node.finish(1, f"{self._expected}: {problem}")

    def deactivate(self, ended: FlightState) -> None:
        """Check how the vehicle takes silence, and leave."""
        failed = ended.state == FlightState.FAILED and (COMMAND in ended.reason or COMMANDING in ended.reason)
        wrong = "" if failed else f"flight/state {ended.state}, reason {ended.reason!r}"
        self._found[self._expected] = f"the vehicle ended the flight before: {ended.reason}" if self._left else wrong
        self.node.finish(0, "checked")


def main() -> None:
    """Run the check and print what was found."""
    if "--help" in sys.argv or "-h" in sys.argv:
        sys.stdout.write(HELP + "\n")
        sys.exit(0)
    found: dict[str, str] = {}
    code = run(COMMANDING, lambda: PlantCheck(found), "", [*sys.argv, "--ros-args", "-p", f"flight.roles:={ROLES}"])
    if code == 2:
        sys.exit(2)
    if code == 1 and not any(found.values()):
        found["a flight"] = "none was flown to its end: see the messages above"
    sys.stdout.write(report(found) + "\n")
    sys.exit(1 if any(found.values()) else 0)

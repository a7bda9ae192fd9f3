"""The rules that single messages of a vehicle keep or break, and the findings as a table. No ROS."""

import math
from typing import Any

from quad_core.cascade import SIMULATOR
from quad_core.cycle import is_flyable
from quad_core.flight_parameters import LOCKSTEP, FlightParameters
from quad_core.types import VehicleState
from quad_node.handshake import run_number

ACTUATION = "actuation of every step"


class Report:
    """What was checked, {rule: what was wrong with it, empty if it is kept}; the first problem of a rule stays."""

    def __init__(self) -> None:
        """Start empty."""
        self._found: dict[str, str] = {}

    def add(self, rule: str, problem: str = "") -> None:
        """Note that ``rule`` was checked and what was wrong."""
        self._found[rule] = self._found.get(rule) or problem

    @property
    def broken(self) -> dict[str, str]:
        """Return {rule: problem} of the broken rules."""
        return {rule: problem for rule, problem in self._found.items() if problem}

    def text(self) -> str:
        """Return one line per rule and a last line with the result."""
        lines = [f"FAIL  {rule}: {problem}" if problem else f"ok    {rule}" for rule, problem in self._found.items()]
        broken = f", {len(self.broken)} broken" if self.broken else ""
        return "\n".join([*lines, f"{len(self._found) - len(self.broken)} of {len(self._found)} kept{broken}"])


class Rules:
    """Checks messages by the contract and notes the findings in a report."""

    def __init__(self, report: Report, flight: FlightParameters, interface_hash: str) -> None:
        """Check by the parameters and the messages that the check itself has."""
        self._report, self._flight, self._hash = report, flight, interface_hash
        self.lockstep = flight.mode == LOCKSTEP
        self.last: tuple[int, VehicleState] | None = None
        self.ready = self.flown = False
        self._sent: dict[str, int] = {}
        self._run_id = flight.run_id

    def _equal(self, rule: str, found: Any, expected: Any) -> None:
        self._report.add(rule, "" if found == expected else f"found {found!r}, expected {expected!r}")

    def status(self, message: Any) -> None:
        """Check a quad_msgs/NodeStatus of a node that is not the check."""
        self._equal("flight/nodes: the vehicle has the role simulator", message.role, SIMULATOR)
        if message.role == SIMULATOR:
            self._run_id = message.run_id
            self._identity(message)
            self._equal("the vehicle was built with the same quad_msgs", message.interface_hash, self._hash)
            period = self._flight.plant_period
            self._equal("flight/nodes: plant_period is flight.plant_period", message.plant_period, period)
            self.ready = self.ready or message.state == 1

    def phase(self, message: Any) -> None:
        """Check a quad_msgs/FlightState; its interface hash may be empty."""
        self._identity(message)
        self._equal("the vehicle was built with the same quad_msgs", message.interface_hash or self._hash, self._hash)
        self.flown = self.flown or message.state == 1

    def _identity(self, message: Any) -> None:
        asked = self._flight.run_id or message.run_id
        self._equal("the vehicle has the flight's run id", message.run_id, asked)

    def run(self, topic: str, found: int) -> None:
        """Check the field ``run`` of a message of a step."""
        asked = run_number(self._run_id)
        wrong = f"{topic}: found {found}, expected {asked}, the CRC-32 of {self._run_id!r}"
        self._report.add("state and actuation carry the number of the vehicle's run", wrong if found != asked else "")

    def state(self, state: VehicleState, step: int, stamp_ns: int) -> bool:
        """Check a state; returns whether it is the last one again."""
        last_step, last = self.last or (step - 1, None)
        if last is None:
            self._equal("the first state is step 0", step, 0)
        expected = step * self._flight.plant_period
        wrong = "" if stamp_ns == expected else f"step {step} has stamp {stamp_ns} ns, expected {expected}"
        self._report.add("stamp of state = step x flight.plant_period", wrong)
        good = is_flyable(state)
        self._report.add(
            "state is finite, within bounds, its quaternion of norm 1", "" if good else f"step {step}: {state}"
        )
        if step == last_step:
            same = "" if last == state else " with other numbers"
            self._report.add("the state of a step comes once", f"step {step} came again{same}")
            return True
        kept = step == last_step + 1 if self.lockstep else step > last_step
        order = "steps come in order" + (", none left out" if self.lockstep else "")
        self._report.add(order, "" if kept else f"{step} after {last_step}")
        self.last = (step, state)
        return False

    def actuation(self, step: int, numbers: tuple[float, ...]) -> None:
        """Check thrust and torque of one step."""
        self._every_step(ACTUATION, "actuation", step)
        self._report.add("actuation is finite", "" if all(map(math.isfinite, numbers)) else f"step {step}")

    def optional(self, topic: str, step: int) -> None:
        """Check the step of a topic that may be left out: lockstep records it whole, or waits for what is missing."""
        self._every_step(f"{topic} is sent of every step, or never", topic, step)

    def _every_step(self, rule: str, topic: str, step: int) -> None:
        before = self._sent.get(topic, -1)
        kept = step in (before, before + 1) or not self.lockstep
        self._report.add(rule, "" if kept else f"step {step} after {before}")
        self._sent[topic] = step

    def flight(self) -> None:
        """Check what should have been seen by the end of the manoeuvres."""
        self._report.add("the vehicle says READY on flight/nodes", "" if self.ready else "it never did")
        self._report.add("flight/state is FLYING while states are sent", "" if self.flown else "it never was")
        newest, actuated = self.last[0] if self.last else 0, self._sent.get("actuation", -1)
        behind = "" if newest - actuated <= 100 else f"none after step {actuated}, state is at {newest}"
        self._report.add(ACTUATION, behind)

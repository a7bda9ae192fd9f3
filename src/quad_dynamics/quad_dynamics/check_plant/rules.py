"""The rules that single messages of a vehicle keep or break. No ROS."""

import math
from typing import Any

from quad_core.cascade import SIMULATOR
from quad_core.cycle import is_flyable
from quad_core.flight_parameters import LOCKSTEP, FlightParameters
from quad_core.types import VehicleState
from quad_dynamics.check_plant.report import Report
from quad_node.handshake import run_number

RUN_ID = "the vehicle has the flight's run id"
RUN = "state and actuation carry the number of the vehicle's run"
HASH = "the vehicle was built with the same quad_msgs"
PERIOD = "flight/nodes: plant_period is flight.plant_period"
ROLE = "flight/nodes: the vehicle has the role simulator"
STAMP = "stamp of state = step x flight.plant_period"
BOUNDS = "state is finite, within bounds, its quaternion of norm 1"
ORDER = "steps come in order"
FIRST = "the first state is step 0"
WAITS = "the plant waits for the answer to its state"
ONCE = "the state of a step comes once"
ACTUATION = "actuation of every step"
FINITE = "actuation is finite"
READY = "the vehicle says READY on flight/nodes"
FLYING = "flight/state is FLYING while states are sent"


class Rules:
    """Judges messages by the contract and notes the findings in a report."""

    def __init__(self, report: Report, flight: FlightParameters, interface_hash: str) -> None:
        """Judge by the parameters and the messages that the check itself has."""
        self._report, self._flight, self._hash = report, flight, interface_hash
        self.lockstep = flight.mode == LOCKSTEP
        self.last: tuple[int, VehicleState] | None = None
        self._actuated = -1
        self._sent: dict[str, int] = {}
        self.ready = self.flown = False
        self._run_id = flight.run_id

    def status(self, message: Any) -> None:
        """Judge a quad_msgs/NodeStatus of whoever is not the check."""
        if message.role != SIMULATOR:
            self._report.add(ROLE, f"found {message.role!r}")
            return
        self._report.add(ROLE)
        self._run_id = message.run_id
        self.identity(message)
        wrong = "" if message.plant_period == self._flight.plant_period else f"found {message.plant_period} ns"
        self._report.add(PERIOD, wrong and f"{wrong}, expected {self._flight.plant_period} ns")
        self.ready = self.ready or message.state == 1

    def identity(self, message: Any) -> None:
        """Judge run id and interface hash of a NodeStatus or FlightState; an empty hash is allowed in the latter."""
        asked = self._flight.run_id
        wrong = f"found {message.run_id!r}, expected {asked!r}" if asked and message.run_id != asked else ""
        self._report.add(RUN_ID, wrong)
        if message.interface_hash or hasattr(message, "role"):
            wrong = "" if message.interface_hash == self._hash else f"found {message.interface_hash[:12]!r}"
            self._report.add(HASH, wrong and f"{wrong}, expected {self._hash[:12]!r}")

    def run(self, topic: str, found: int) -> None:
        """Judge the field ``run`` of a message of a step."""
        asked = run_number(self._run_id)
        wrong = f"{topic}: found {found}, expected {asked}, the CRC-32 of {self._run_id!r}"
        self._report.add(RUN, wrong if found != asked else "")

    def phase(self, message: Any) -> None:
        """Judge a quad_msgs/FlightState."""
        self.identity(message)
        self.flown = self.flown or message.state == 1

    def state(self, state: VehicleState, step: int, stamp_ns: int) -> bool:
        """Judge a state; returns whether it is the last one again."""
        if self.last is None:
            self._report.add(FIRST, "" if step == 0 else f"found step {step}")
        expected = step * self._flight.plant_period
        wrong = "" if stamp_ns == expected else f"step {step} has stamp {stamp_ns} ns, expected {expected}"
        self._report.add(STAMP, wrong)
        self._report.add(BOUNDS, "" if is_flyable(state) else f"step {step}: {state}")
        if self.last is not None and step == self.last[0]:
            same = "" if self.last[1] == state else " with other numbers"
            self._report.add(ONCE, f"step {step} came again{same}")
            return True
        if self.last is not None:
            left_out = step - self.last[0] - 1
            kept = left_out == 0 if self.lockstep else left_out >= 0
            name = ORDER + (", none left out" if self.lockstep else "")
            self._report.add(name, "" if kept else f"{step} after {self.last[0]}")
        self.last = (step, state)
        return False

    def actuation(self, step: int, numbers: tuple[float, ...]) -> None:
        """Judge thrust and torque of one step."""
        if self.lockstep and step not in (self._actuated, self._actuated + 1):
            self._report.add(ACTUATION, f"step {step} after {self._actuated}")
        self._report.add(ACTUATION)
        self._actuated = step
        self._report.add(FINITE, "" if all(map(math.isfinite, numbers)) else f"step {step}")

    def optional(self, topic: str, step: int) -> None:
        """Judge the step of a topic that may be left out: lockstep records it whole, or waits for what is missing."""
        before = self._sent.get(topic, -1)
        kept = step in (before, before + 1) or not self.lockstep
        self._report.add(f"{topic} is sent of every step, or never", "" if kept else f"step {step} after {before}")
        self._sent[topic] = step

    def flight(self) -> None:
        """Judge what should have been seen by the end of the manoeuvres."""
        self._report.add(READY, "" if self.ready else "it never did")
        self._report.add(FLYING, "" if self.flown else "it never was")
        newest = self.last[0] if self.last else 0
        behind = "" if newest - self._actuated <= 100 else f"none after step {self._actuated}, state is at {newest}"
        self._report.add(ACTUATION, behind)

"""The commander node: decides which mode is flown, makes the reference of every mode, answers requests.

A step is the state of every ``period_steps``-th plant step together with its `mission/reference` and `flight/guard`.
In real time a step waits until the next state at most, and where no state comes a tick of 50 ms decides.
``CommanderCore.step`` (commander_core.py) makes the decision of all that ``_decide`` gathers. The nodes of a
flight follow `reference` and `flight/mode/steps`, both of one decision; `flight/mode` is latched and shows others the
newest mode. A mode with ``is_over`` asks for the end of the flight; the node leaves when `flight/state` says ENDED or
FAILED, or the vehicle interface is silent for long.

Subscribes: state (VehicleState), mission/reference (TrajectoryPoint), flight/guard (GuardStatus), attitude_setpoint
(AttitudeThrust), wrench_setpoint (WrenchStamped), flight/plan (FlightPlan), flight/nodes (NodeStatus), flight/request
(FlightRequest), flight/autopilot (AutopilotStatus), battery_state (BatteryState), flight/events (FlightEvent).
Publishes: reference, flight/mode/steps, flight/mode, and what every node does. Services: one for each request, with its
name in lower case (services.py): ``goto`` (Goto), ``takeoff``, ``hold``, ``land`` and the others (Trigger).
"""

import math
import sys
import time
from collections import deque
from collections.abc import Iterator
from functools import partial
from typing import Any

from rclpy.publisher import Publisher
from sensor_msgs.msg import BatteryState

from quad_commander import missions
from quad_commander.commander_core import MISSION_REFUSED, MISSION_SENDER, REQUEST_REFUSED, CommanderCore, Outputs
from quad_commander.mode_table import GRANTED
from quad_commander.modes import Inputs
from quad_commander.preflight import Preflight
from quad_commander.request_queue import MOST_SENDERS, PendingRequest, RequestQueue
from quad_commander.services import SERVICES, is_finite, place_of, sender_of
from quad_core import plugins
from quad_core.cascade import COMMAND, COMMANDER, RECORDER
from quad_core.cycle import seconds
from quad_core.enumerations import ON_GROUND, GuardMode, Mode, Request
from quad_core.types import GuardStatus, TrajectoryPoint
from quad_msgs.msg import AutopilotStatus, FlightEvent, FlightMode, FlightPlan, FlightRequest
from quad_msgs.msg import TrajectoryPoint as TrajectoryPointMsg
from quad_node import topics
from quad_node.codec import Stamped, head_of, packer, set_stamp
from quad_node.flight_node import FlightNode
from quad_node.main import run
from quad_node.responder import Responder, Sample

_CHECKS_EVERY, _FIRST_LOOK = 0.3, 1.0  # s; over which an autopilot that is not armed yet is looked at
_WINDOW = 1.0  # s over which late cycles are counted
_TICK = 0.05  # s between two calls of ``_watch``: what comes later was a pause of this node itself
_LONGEST_SENDER, _UNNAMED = 200, "unnamed"  # characters; the sender of a request that names none
_REQUESTS = frozenset(GRANTED)
_MOST_REQUESTS = 512  # messages: a burst of others must not push out a KILL before it is read
_MISSED_TICKS = 0.1  # s: the same for the state, which may be all that is missing from one tick to the next


class Commander:
    """Decides which mode is flown, and makes its reference."""

    def __init__(self) -> None:
        """Read the mission and join; raises as FlightNode."""
        self.node = node = FlightNode(COMMANDER, watch=self._watch)
        self.responder = Responder(node, self.step)
        self.settings, self._period = node.settings, node.flight.plant_period
        known = plugins.names(plugins.TRAJECTORY)
        text = self.settings.mission
        self._mission = missions.parse(text, known) if text else ()
        self._core: CommanderCore | None = None
        self._requests = RequestQueue()
        self._end_asked = ""
        self._recorder_lost = self._estimator_reset = False
        self._preflight = Preflight(node.flight, self.settings)
        self._since_check = 0.0
        self._cycles: deque[int] = deque()
        self._last: Sample | None = None
        self._battery: float | None = None
        self._bad_battery = ""
        self._autopilot: AutopilotStatus | None = None
        self._resets = 0
        self._stepped_at = 0.0
        self._awake = time.monotonic()
        self._sent = -1
        self._heard = {"attitude_setpoint": node.started, COMMAND: node.started}
        self._mission_in = self.responder.take("mission/reference")
        self._guard_in = self.responder.take("flight/guard", lag=1, kind=GuardStatus)
        for topic in self._heard:
            node.links.subscribe(topic, partial(self._on_life, topic), raw=True)
        node.links.subscribe("flight/plan", self._on_plan)
        node.links.subscribe("flight/nodes", self._preflight.on_node, depth=64)
        self._requests_in = node.links.subscribe("flight/request", self._on_requests, depth=_MOST_REQUESTS)
        node.links.subscribe("flight/autopilot", self._on_autopilot)
        node.links.subscribe("battery_state", self._on_battery)
        node.links.subscribe("flight/events", self._on_event, depth=64)
        self._reference_out = node.links.publisher("reference")
        self._mode_out = node.links.publisher("flight/mode")
        self._mode_shown = node.ros.create_publisher(FlightMode, "flight/mode", topics.latched())
        self._pack = packer(TrajectoryPoint, TrajectoryPointMsg, node.run)
        self._offered = [
            node.ros.create_service(kind, request.name.lower(), partial(self._on_call, request))
            for request, kind in SERVICES.items()
        ]

    def step(self, sample: Sample, arrivals: list[Stamped | None]) -> Iterator[tuple[Publisher, Any]]:
        """Give reference and mode of one step, both from one decision."""
        self._forgive_own_pause(time.monotonic())
        mission_arrival, guard_arrival = arrivals
        if mission_arrival is not None and self.node.lockstep:
            self.responder.given_up.clear()
        self._last, self._stepped_at = sample, time.monotonic()
        yield from self._messages(sample, self._decide(sample, guard_arrival, 0.0))

    def _decide(self, sample: Sample, guard_arrival: Stamped | None, state_age: float) -> Outputs:
        if self._core is None:
            self._core = CommanderCore(self.settings, self._mission, sample.state, self._requests)
        mission = self._mission_in.newest
        lag = seconds(sample.step - mission.step, self._period) if mission else 0.0
        seen = Inputs(
            step=sample.step,
            dt=sample.dt,
            state=sample.state,
            mission=mission.value if mission else None,
            mission_lag=max(lag, 0.0),
            # in lockstep the plant waits for it, so it is never old
            setpoint_age=0.0 if self.node.lockstep else time.monotonic() - self._heard["attitude_setpoint"],
            state_age=state_age,
            overruns=self._late_cycles(sample.step),
            guard=self._guard_said(guard_arrival),
            battery=1.0 if self._charge is None else self._charge,
            refusals=self._checks(sample),
            recorder_lost=self._recorder_lost,
            end_asked=self._end_asked,
            # what an autopilot says of resets stands above ours
            **{"estimator_reset": self._estimator_reset, **self._of_autopilot()},
        )
        said = self._core.step(seen)
        self._estimator_reset = False
        for kind, text in said.news:
            say = self.node.events.warn if kind in (REQUEST_REFUSED, MISSION_REFUSED) else self.node.events.info
            say(kind, text, sample.stamp_ns, always=True)
        return said

    def _messages(self, sample: Sample, said: Outputs) -> Iterator[tuple[Publisher, Any]]:
        step, next_step = sample.step, sample.step + self.node.period_steps
        if step <= self._sent:  # decided without its state, which came all the same: no second message of one step
            return
        self._sent = step
        yield self._reference_out, self._pack(said.reference, step, next_step, sample.stamp_ns)
        mode = FlightMode(
            **said.mode._asdict(),
            step=step,
            next_step=next_step,
            name=Mode(said.mode.mode).name,
            text=said.text,
            sender=said.sender,
            answer_text=said.answer_text,
            outcome=said.outcome,
            run=self.node.run,
        )
        set_stamp(mode.stamp, sample.stamp_ns)
        yield self._mode_out, mode
        yield self._mode_shown, mode

    def _watch(self) -> None:
        """Take in a signal; in real time decide also when no state comes any more."""
        node, every = self.node, self.node.period_steps
        self._end_asked = self._end_asked or node.asked_to_end
        self._look_for_the_recorder()
        if node.lockstep:
            self._give_up_mission()
        if node.lockstep or self._last is None or not node.flying:
            return
        now = time.monotonic()
        self._forgive_own_pause(now)
        quiet = now - self.responder.state_heard
        if quiet <= self.settings.modes.state_lost:
            return
        passed = int(quiet * 1e9) // self._period
        step = self._last.step + passed // every * every
        stamp = step * self._period
        sample = Sample(step, stamp, self._last.state, now - self._stepped_at)
        self._stepped_at = now
        for publisher, message in self._messages(sample, self._decide(sample, None, quiet)):
            publisher.publish(message)

    def _give_up_mission(self) -> None:
        """In lockstep go on without a mission reference that stays away: that becomes HOLD, then LAND."""
        responder, topic = self.responder, self._mission_in.topic
        is_there = self._mission_in.at(responder.next_step) is not None
        if not responder.waits or is_there or topic in responder.given_up:
            return
        if time.monotonic() - responder.state_heard > self.settings.give_up:
            responder.given_up.add(topic)
            text = f"step {responder.next_step}: no mission/reference; going on without it"
            self.node.events.warn("mission_lost", text)
            responder.answer()

    def _look_for_the_recorder(self) -> None:
        node = self.node
        if not node.flying or RECORDER not in node.roles:
            return
        before, self._recorder_lost = self._recorder_lost, not node.ros.count_publishers("flight/recorded")
        if self._recorder_lost and not before:
            text = "flight/recorded: the recorder has left; what is flown from now on is not recorded"
            node.events.warn("recorder_lost", text)

    def _forgive_own_pause(self, now: float) -> None:
        """Let nothing grow old over the time in which this node itself stood still and received nothing."""
        since, self._awake = now - self._awake, now
        if (pause := since - _TICK) > 0.0:
            self._heard = {topic: min(heard + pause, now) for topic, heard in self._heard.items()}
        if since > _MISSED_TICKS:
            self.responder.state_heard = min(self.responder.state_heard + since, now)

    def _on_life(self, topic: str, payload: bytes) -> None:
        """Note that ``topic`` is alive; a wrench names no run, and its value matters to others."""
        if topic != COMMAND and self.node.is_foreign(topic, head_of(payload)[1]):
            return
        self._heard[topic] = time.monotonic()
        self._preflight.count(topic)

    def _late_cycles(self, step: int) -> float:
        """Return the share of this node's cycles of the last second that did not take place."""
        if self.node.lockstep or self._autopilot is not None:  # an autopilot sends states at its own rate
            return 0.0
        window = round(_WINDOW * 1e9 / self._period)
        self._cycles.append(step)
        while self._cycles[0] < step - window:
            self._cycles.popleft()
        due = (step - self._cycles[0]) / self.node.period_steps
        return 1.0 - (len(self._cycles) - 1) / due if due * self.node.period_steps >= 0.9 * window else 0.0

    def _checks(self, sample: Sample) -> list[str] | None:
        """Return the reasons against arming, every ``_CHECKS_EVERY`` s while ARMING, before it for an autopilot."""
        mode = self._core.mode if self._core is not None else Mode.DISARMED
        is_first_look = mode == Mode.DISARMED and self._autopilot is not None
        if mode in ON_GROUND:
            self._preflight.note(sample)
        if mode != Mode.ARMING and not is_first_look:
            self._since_check = 0.0
            self._preflight.begin(sample, self.responder.states_seen)
            return None
        self._since_check += sample.dt
        if self._since_check < (_FIRST_LOOK if is_first_look else _CHECKS_EVERY):
            return None
        self._since_check = 0.0
        wrong = [*self.node.links.unheard(), *([self._bad_battery] if self._bad_battery else [])]
        seen = self.responder.states_seen
        found = self._preflight.refusals(sample, seen, wrong, self._charge, self._autopilot, is_first_look)
        if is_first_look:
            self._preflight.begin(sample, seen)
        return found

    def _guard_said(self, arrival: Stamped | None) -> GuardStatus:
        """Return what the guard said, last if not of this step; disarmed it rests, and what it did before is over."""
        newest = arrival or self._guard_in.newest
        said: GuardStatus = newest.value if newest else GuardStatus()
        on_ground = self._core is None or self._core.mode in ON_GROUND
        is_killed = said.mode == GuardMode.KILL and self._autopilot is None
        return GuardStatus() if on_ground and not is_killed else said

    def _on_event(self, message: FlightEvent) -> None:
        """Note that the estimate jumped, as the relay or a bridge in this namespace says."""
        is_ours = message.node.startswith(self.node.ros.get_namespace())
        self._estimator_reset |= is_ours and message.kind == "estimator_reset"

    def _on_autopilot(self, message: AutopilotStatus) -> None:
        if not self.node.is_foreign("flight/autopilot", message.run):
            self._autopilot = message

    def _of_autopilot(self) -> dict[str, Any]:
        """Return what the autopilot that owns the vehicle said last; it says itself what jumped, seen once."""
        said = self._autopilot
        if said is None:
            return {}
        jumped, self._resets = said.resets > self._resets, said.resets
        found = {"by_autopilot": True, "autopilot_flies": said.flies, "estimator_reset": jumped}
        return {**found, "pilot": said.pilot, "landed": said.landed, "position_good": not said.position_lost}

    @property
    def _charge(self) -> float | None:
        """The battery's share of full: its driver's, else the autopilot's; None if neither tells it."""
        if self._battery is not None or self._autopilot is None or math.isnan(self._autopilot.battery):
            return self._battery
        return self._autopilot.battery

    def _on_battery(self, message: BatteryState) -> None:
        share = message.percentage
        self._bad_battery = ""
        if 0.0 <= share <= 1.0:
            self._battery = share
        elif not math.isnan(share):  # a driver that does not know it says so
            self._bad_battery = f"battery_state: found percentage {share:g}, expected 0 to 1, or NaN if it is unknown"
            self.node.events.warn("bad_battery", f"{self._bad_battery}; message ignored")

    def _on_plan(self, message: FlightPlan) -> None:
        if self.node.is_foreign("flight/plan", message.run):
            return
        flying = self._core is not None and self._core.mode not in ON_GROUND
        self._preflight.on_plan(message, flying)

    def _on_requests(self, message: FlightRequest) -> None:
        """Take all that wait, not one per turn of the executor: a KILL must not wait behind a flood."""
        self._on_request(message)
        for _ in range(_MOST_REQUESTS):
            taken = self._requests_in.handle.take_message(FlightRequest, False)
            if taken is None:
                return
            self._on_request(taken[0])

    def _on_request(self, message: FlightRequest) -> None:
        found, expected, sender = "", "one of its constants", message.sender or _UNNAMED
        if sender == MISSION_SENDER:  # its refusals count against the mission
            sender = f"another {sender}"
        if len(message.sender) > _LONGEST_SENDER or not message.sender.isprintable():  # every mode says it again
            found = f"a sender of {len(message.sender)} characters"
            expected = f"at most {_LONGEST_SENDER} printable ones"
        elif message.run and self.node.is_foreign("flight/request", message.run):
            return
        elif message.request == Request.END:
            self._end_asked = self._end_asked or message.sender or "end asked for"
            return
        elif message.request not in _REQUESTS:
            found = f"request {message.request} of {sender}"
        place = None
        if not found and message.request == Request.GOTO:
            place = place_of(message)
            if not is_finite(place):
                found, expected = f"goto {place}", "finite numbers"
        if found:
            text = f"flight/request: found {found}, expected {expected}; message ignored"
            self.node.events.warn("bad_request", text)
        else:
            self._ask(PendingRequest(Request(message.request), sender, place=place))

    def _ask(self, asked: PendingRequest) -> bool:
        """Take in a request for the next step; return False if the queue is full."""
        is_taken = self._requests.add(asked)
        if not is_taken:
            who = f"{asked.request.name} of {asked.sender}"
            text = f"flight/request: {who}: {MOST_SENDERS} senders wait; message ignored"
            self.node.events.warn("too_many_requests", text)
        return is_taken

    def _on_call(self, request: Request, asked: Any, response: Any) -> Any:
        place = place_of(asked) if request == Request.GOTO else None
        wanted, refusal = PendingRequest(request, sender_of(request), place=place), ""
        if place is not None and not is_finite(place):
            refusal = f"found goto {place}, expected finite numbers"
        elif request == Request.END:
            self._end_asked = self._end_asked or "asked to end by a service"
        else:
            refusal = self._core.foresee(wanted) if self._core else "the flight has not begun"
        if not (refusal or request == Request.END or self._ask(wanted)):
            refusal = f"{request.name}: {MOST_SENDERS} senders wait; ask again"
        response.success = not refusal
        response.message = (
            refusal or f"{request.name}: takes effect at the next decision after step {self.node.current_step}"
        )
        return response


def main() -> None:
    """Run the commander node."""
    sys.exit(run(COMMANDER, Commander, "Commander: modes, missions and the reference of every mode."))

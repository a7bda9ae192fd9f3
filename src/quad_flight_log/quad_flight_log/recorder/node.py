"""The recorder node: every message of a flight into one bag, and flow control for the lockstep."""

import struct
import sys
import time
from collections.abc import Callable
from datetime import datetime, timezone
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.serialization import deserialize_message, serialize_message

from quad_core.cascade import RECORDER
from quad_flight_log.bag.notes import Qos
from quad_flight_log.bag.writer import BACKLOG_LIMIT, MESSAGE_LIMIT, BagReport, BagWriter
from quad_flight_log.recorder.flight_clock import FlightClock
from quad_flight_log.recorder.gap_counter import GapCounter
from quad_flight_log.recorder.message_fields import definition_of
from quad_flight_log.recorder.opening import opened
from quad_flight_log.recorder.payload_check import PayloadCheck
from quad_flight_log.recorder.provenance import STOPPED, end_metadata, flight_metadata
from quad_flight_log.recorder.shadow_pace import ShadowPace
from quad_flight_log.recorder.step_tracker import Arrival, StepTracker
from quad_flight_log.recorder.vehicle_pose import PoseWriter
from quad_msgs.msg import FlightEvent, FlightState, NodeStatus, RecorderAck
from quad_node import topics
from quad_node.codec import head_of, names_run
from quad_node.flight_node import FlightNode
from quad_node.handshake import is_foreign
from quad_node.interface import interface_hash, versions
from quad_node.main import run

_STAMP = struct.Struct("<iI")
_STEP_DEPTH = topics.REALTIME_HISTORY
_LATCHED_DEPTH = 64
_SILENCE = 1.0  # s without a message of any step after which a failed flight has no more
_GRACE = 0.15  # s in which the last messages of the other nodes still arrive
_TAIL_NS = 100_000_000  # before the end, in real time: what a late plant left out there
_TOO_LARGE = f"a message of {{}} bytes, more than the {MESSAGE_LIMIT} that are recorded"


class Recorder(FlightNode):
    """Writes raw messages; ``log_time`` is the flight's clock, ``publish_time`` the wall clock at reception."""

    def __init__(self) -> None:
        """Create the bag; raises as FlightNode, or ParameterError if the directory cannot be recorded to."""
        super().__init__(RECORDER)
        self.settings = self.resolved.node
        self.bag = self._create_bag()
        self.tracker: StepTracker | None = None
        self._gaps = GapCounter({})
        self._periods: dict[str, int] = {}
        self._stamps = FlightClock(time.monotonic())
        self._acked = -1
        self._due_ns = (self.settings.ack_steps - 1) * self.flight.plant_period
        self._last: FlightState | None = None
        self._ended = self._arrived = 0.0
        self._ack_out = self.publisher("flight/recorded", match=self.lockstep)  # only lockstep waits for it
        self._ack_handle = self._declare("flight/recorded", topics.TOPICS["flight/recorded"].type, latched=False)
        self._shadows = ShadowPace(self.flight.plant_period)
        self._poses = PoseWriter(self.bag, self.resolve_topic_name("pose"), self.get_namespace())
        self._path = "truth" if topics.TOPICS["truth"].exists(self.roles) else "state"
        for topic in topics.TOPICS.values():
            if self.role in topic.subscribers and topic.exists(self.roles):
                self._record(topic)
        handle = self._declare("diagnostics", DiagnosticArray, latched=False)
        keep = self._checked("diagnostics", DiagnosticArray, handle, self._plain(handle))
        self.create_subscription(DiagnosticArray, "diagnostics", keep, topics.stream(64), raw=True)

    @property
    def _flight_ns(self) -> int:
        return self._stamps.newest

    def _create_bag(self) -> BagWriter:
        name = self.flight.run_id or datetime.now(timezone.utc).strftime("%Y%m%d-%H%M%S")
        directory = Path(self.settings.directory or Path("flights", name))
        mode = "lockstep" if self.lockstep else "realtime"
        facts = {
            "run_id": self.flight.run_id,
            "seed": self.flight.seed,
            "mode": mode,
            "plant_period_ns": self.flight.plant_period,
            "namespace": self.get_namespace(),
            "interface_hash": interface_hash(),
        }
        return opened(directory, self.settings.parameters_file, flight_metadata(facts, versions()))

    def _declare(self, name: str, kind: type, latched: bool) -> int:
        qos = Qos(1, durability="transient_local") if latched else Qos(10)
        return self.bag.add_topic(self.resolve_topic_name(name), definition_of(kind), qos)

    def _record(self, topic: topics.Topic) -> None:
        handle = self._declare(topic.name, topic.type, topic.latched)
        keep, depth = self._plain(handle), _LATCHED_DEPTH if topic.latched else _STEP_DEPTH
        if topic.step:
            keep = self._stepped(topic.name, handle)
            if topic.name == self._path:
                keep = self._poses.following(keep, lambda: self._flight_ns)
        elif topic.name == "flight/nodes":
            keep = self._with_status(keep)
        elif topic.name.startswith(topics.SHADOW_TOPICS):
            self._shadows.expect(topic.name)
            keep = self._with_stamp(topic.name, keep)
        self.subscribe(topic.name, self._checked(topic.name, topic.type, handle, keep), depth=depth, raw=True)

    def _checked(self, name: str, kind: type, handle: int, keep: Callable[[bytes], None]) -> Callable[[bytes], None]:
        """Return ``keep`` for what can be decoded and is of this run; the rest is counted, reported, not recorded."""
        problem_of, has_run = PayloadCheck(kind), names_run(kind)

        def on_message(payload: bytes) -> None:
            problem = problem_of(payload) if len(payload) <= MESSAGE_LIMIT else _TOO_LARGE.format(len(payload))
            if not problem and has_run and self.run not in (0, head_of(payload)[1]):
                problem = "a message of another run"
            if problem:
                self.bag.refuse(handle)
                self.event(FlightEvent.WARNING, "not_recorded", f"{name}: {problem}", self._flight_ns)
            else:
                keep(payload)

        return on_message

    def _plain(self, handle: int) -> Callable[[bytes], None]:
        def keep(payload: bytes) -> None:
            self.bag.write(handle, payload, self._flight_ns, time.time_ns())

        return keep

    def _stepped(self, name: str, handle: int) -> Callable[[bytes], None]:
        unpack, write, steady, wall = _STAMP.unpack_from, self.bag.write, time.monotonic, time.time_ns
        stamps = self._stamps

        def keep(payload: bytes) -> None:
            self._arrived = steady()
            seconds, nanoseconds = unpack(payload, 4)
            stamp = seconds * 1_000_000_000 + nanoseconds
            if stamp > stamps.newest and not stamps.believes(stamp, self._arrived):
                self.bag.refuse(handle)
                text = f"{name}: stamp {stamp} ns is far ahead of the flight; not recorded"
                self.event(FlightEvent.WARNING, "far_ahead", text, self._flight_ns)
                return
            if self.tracker is not None:
                kind = self.tracker.add(name, stamp, payload)
                if kind is not Arrival.NEW:
                    self._unusual(name, stamp, kind)
                    if kind is not Arrival.OFF_STEP:
                        return
            else:
                self._gaps.add(name, stamp)
            newest = stamps.newest
            write(handle, payload, newest, wall())
            if newest >= self._due_ns:
                self._acknowledge()

        return keep

    def _with_status(self, keep: Callable[[bytes], None]) -> Callable[[bytes], None]:
        def on_message(payload: bytes) -> None:
            keep(payload)
            status = deserialize_message(payload, NodeStatus)
            if status.role in self.roles and not is_foreign(status.run_id, self.flight.run_id):
                self._periods[status.role] = max(status.period_steps, 1)  # 0: the simulator refuses the flight

        return on_message

    def _with_stamp(self, name: str, keep: Callable[[bytes], None]) -> Callable[[bytes], None]:
        def on_message(payload: bytes) -> None:
            keep(payload)
            seconds, nanoseconds = _STAMP.unpack_from(payload, 4)
            self._shadows.add(name, seconds * 1_000_000_000 + nanoseconds)
            if self._stamps.newest >= self._due_ns:
                self._acknowledge()

        return on_message

    def _unusual(self, name: str, stamp: int, kind: Arrival) -> None:
        if kind is Arrival.CONFLICT:
            # a warning, for they come by the thousand: every one is counted and fails the flight
            text = f"{name}: a second, different message for stamp {stamp} ns; not recorded"
            self.event(FlightEvent.WARNING, "conflict", text, stamp)
        elif kind is Arrival.OFF_STEP:
            self.event(FlightEvent.WARNING, "off_step", f"{name}: stamp {stamp} ns belongs to no step of it", stamp)
        else:
            self.counters["repeat"] += 1

    def _acknowledge(self) -> None:
        """Let the plant go on; held back while the disk is behind."""
        if self.tracker is None or self.bag.backlog > BACKLOG_LIMIT // 4:
            return
        complete = self._shadows.leave(self.tracker.complete_through())
        if complete < max(self._acked + self.settings.ack_steps, 0):
            return
        self._acked = self.current_step = complete
        self._due_ns = (complete + self.settings.ack_steps) * self.flight.plant_period
        dropped = sum(self.bag.dropped.values()) + self.counters["conflict"]
        payload = serialize_message(RecorderAck(step=complete, run=self.run, dropped=dropped))
        self._ack_out.publish(payload)
        self.bag.write(self._ack_handle, payload, self._flight_ns, time.time_ns())

    def missing_links(self) -> list[str]:
        """Return unmatched topics and the roles whose period is not known yet."""
        return super().missing_links() + [
            f"flight/nodes of {role}" for role in self.roles if role not in (self.role, *self._periods)
        ]

    def on_ready(self) -> None:
        """Expect a message of every step topic at every step of its publisher."""
        periods: dict[bool, dict[str, int]] = {True: {}, False: {}}
        for topic in topics.TOPICS.values():
            if topic.step and topic.publishers[0] in self.roles and topic.exists(self.roles):
                periods[topic.required][topic.name] = self._periods[topic.publisher_of(self.roles)]
        if self.lockstep:
            self.tracker = StepTracker(periods[True], self.flight.plant_period, optional=periods[False])
            return
        steps = {**periods[True], **periods[False]}
        self._gaps = GapCounter({name: count * self.flight.plant_period for name, count in steps.items()})

    def on_flight_ended(self, message: FlightState) -> None:
        """Remember the end; ``on_tick`` leaves when everything is there."""
        if self._last is None:
            self._last, self._ended = message, time.monotonic()

    def on_signal(self, name: str) -> bool:
        """Return whether a vehicle is in the air that lands first where all nodes were asked: that is recorded."""
        self.asked_to_end = name if self.flying and not self.lockstep else ""
        return bool(self.asked_to_end) or super().on_signal(name)

    def on_tick(self) -> None:
        """Watch the disk and the end of the flight."""
        if self.bag.error and not self.counters["recording_stopped"]:
            self.event(FlightEvent.ERROR, "recording_stopped", self.bag.error, self._flight_ns)
        self._acknowledge()
        now = time.monotonic()
        if self.tracker is None:
            self.current_step = self._flight_ns // self.flight.plant_period
            if self.asked_to_end and self._last is None and now - self._arrived > _SILENCE:
                self.finish(1, f"stopped by {self.asked_to_end}, and no node flies any more")
        if self._last is None or self.done.done():
            return
        # Of a flight that failed some messages never come: silence is enough.
        quiet = self._last.state == FlightState.FAILED and now - self._arrived > _SILENCE
        patience = _GRACE if quiet or self._all_here(self._last.step) else self.settings.finish_timeout
        if now - self._ended > patience:
            self._leave(self._last)

    def _all_here(self, step: int) -> bool:
        if self.tracker is None:
            heard = self._gaps.reached(step * self.flight.plant_period - _TAIL_NS)
            return heard and time.monotonic() - self._arrived > _GRACE
        return self.tracker.complete_through() >= step and self._shadows.answered(step, self._periods)

    def _leave(self, last: FlightState) -> None:
        ended = last.state == FlightState.ENDED
        if self.tracker is None:  # no node waited for us, and a late plant skips steps: counted, no fault
            missing = self._gaps.missing_through(last.step * self.flight.plant_period)
            problem, severity = "", FlightEvent.INFO
        else:
            missing = self.tracker.missing_through(last.step)
            problem, severity = _listed(missing), FlightEvent.ERROR if ended else FlightEvent.WARNING
        if missing:
            self.event(severity, "incomplete", _listed(missing), self._flight_ns)
        report, conflicts = self._closed(ended, last.reason, missing, last.wall_time), self.counters["conflict"]
        problem = report.error or problem or (f"{conflicts} conflicting messages" if conflicts else "")
        if report.error or (ended and problem):
            self.finish(1, problem)
            return
        self.finish(0, f"{report.messages} messages in {report.path.name}")
        self.exit_code = 0 if ended else 1

    def _closed(self, ended: bool, reason: str, missing: dict[str, int], wall_time: float) -> BagReport:
        outcome = {"outcome": "ended" if ended else "failed", "reason": reason, "steps": str(self.current_step)}
        return self.bag.close({**outcome, **end_metadata(self._flight_ns * 1e-9, wall_time, missing, self.counters)})

    def close(self) -> None:
        """Finish the bag of a recorder that was stopped early."""
        self._closed(False, STOPPED, {}, 0.0)

    def measurements(self) -> dict[str, float]:
        """Return what waits for the disk and what was dropped."""
        return {"backlog_bytes": self.bag.backlog, "dropped": sum(self.bag.dropped.values())}


def _listed(missing: dict[str, int]) -> str:
    """Return "missing 3 of state, ...", empty if nothing is missing."""
    return "missing " + ", ".join(f"{count} of {topic}" for topic, count in missing.items()) if missing else ""


def main() -> None:
    """Run the recorder node."""
    sys.exit(run(RECORDER, Recorder, "Recorder: writes every topic of a flight into one rosbag2 MCAP bag."))

"""The recorder node: the topics of ``quad_node.topics`` into one bag, no others, and flow control for the lockstep."""

import inspect
import struct
import sys
import time
from collections.abc import Callable
from datetime import datetime, timezone
from functools import partial
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.serialization import deserialize_message, serialize_message

from quad_core.cascade import RECORDER, RELAY, SHADOWS
from quad_core.enumerations import NodeState
from quad_core.parameters import ParameterError
from quad_flight_log.errors import FlightLogError
from quad_flight_log.notes import STOPPED, flight_metadata
from quad_flight_log.payload_check import definition_of, payload_check
from quad_flight_log.steps import NewestStamp, StepCounter
from quad_flight_log.vehicle_pose import FOLLOWED, PoseOutput
from quad_flight_log.writer import BACKLOG_LIMIT, MESSAGE_LIMIT, BagWriter
from quad_msgs.msg import FlightState, NodeStatus, RecorderAck
from quad_node import topics
from quad_node.codec import head_of, names_run
from quad_node.flight_node import ALL_SIGNALS, FlightNode
from quad_node.handshake import interface_hash, is_foreign, run_number, versions
from quad_node.main import run

_STAMP = struct.Struct("<iI")
_STEP_DEPTH = topics.REALTIME_HISTORY
_LATCHED_DEPTH = 64
_SILENCE = 1.0  # s without a message of any step after which a failed flight has no more
_GRACE = 0.15  # s in which the last messages of the other nodes still arrive
_TAIL_NS = 100_000_000  # before the end, in real time: what a late plant left out there
_TOO_LARGE = f"a message of {{}} bytes, more than the {MESSAGE_LIMIT} that are recorded"

Keep = Callable[[bytes], None]


class Recorder:
    """Writes raw messages; ``log_time`` is the flight's clock, ``publish_time`` the wall clock at reception."""

    def __init__(self) -> None:
        """Create the bag; raises as FlightNode, or ParameterError if the directory cannot be recorded to."""
        self.node = node = FlightNode(
            RECORDER,
            activate=self.activate,
            watch=self._watch,
            deactivate=self.deactivate,
            shut_down=self.shut_down,
            needs=self._needs,
        )
        if not node.lockstep:
            node.outlived = ALL_SIGNALS
        self.settings, self._period = node.settings, node.flight.plant_period
        self.bag = self._create_bag()
        self._clock, self._counter = NewestStamp(time.monotonic()), StepCounter({})
        self._periods: dict[str, int] = {}
        self._number: int | None = None  # of the message of a step that is being taken in, in real time
        self._ready = False
        self._acked = -1
        self._due_ns = (self.settings.ack_steps - 1) * self._period
        self._last: FlightState | None = None
        self._ended = self._arrived = 0.0
        self._ack_out = node.links.publisher("flight/recorded", match=node.lockstep)  # only lockstep waits for it
        self._ack_handle = self._declare("flight/recorded", topics.TOPICS["flight/recorded"].type, latched=False)
        self._poses = PoseOutput(node.ros, self.bag, live=RELAY not in node.roles)  # an estimator shows its pose itself
        for topic in topics.TOPICS.values():
            if RECORDER in topic.subscribers and topic.exists(node.roles):
                self._record(topic)
        handle = self._declare("diagnostics", DiagnosticArray, latched=False)
        keep = self._checked("diagnostics", DiagnosticArray, handle, partial(self._write, handle))
        node.measures.append(self._measured)
        node.ros.create_subscription(DiagnosticArray, "diagnostics", keep, topics.stream(64), raw=True)

    def _create_bag(self) -> BagWriter:
        node, flight = self.node, self.node.flight
        name = flight.run_id or datetime.now(timezone.utc).strftime("%Y%m%d-%H%M%S")
        facts = {
            "run_id": flight.run_id,
            "seed": flight.seed,
            "mode": "lockstep" if node.lockstep else "realtime",
            "plant_period_ns": flight.plant_period,
            "namespace": node.ros.get_namespace(),
            "interface_hash": interface_hash(),
        }
        try:
            directory = self.settings.directory or Path("flights", name)
            return BagWriter(directory, metadata=flight_metadata(facts, versions()))
        except FlightLogError as error:
            raise ParameterError(f"directory: {error}") from error

    def _declare(self, name: str, kind: type, latched: bool) -> int:
        return self.bag.add_topic(self.node.ros.resolve_topic_name(name), definition_of(kind), latched=latched)

    def _record(self, topic: topics.Topic) -> None:
        handle = self._declare(topic.name, topic.type, topic.latched)
        depth = _LATCHED_DEPTH if topic.latched else _STEP_DEPTH
        keep: Keep = partial(self._write, handle)
        is_stepped = topic.step or _of_shadow(topic.name)
        if is_stepped:
            keep = self._stepped(topic.name, handle)
        elif topic.name == "flight/nodes":
            keep = self._with_status(keep)
        take: Callable[..., None] = self._checked(topic.name, topic.type, handle, keep)
        if is_stepped and not self.node.lockstep:
            take = numbered(take, partial(setattr, self, "_number"))
        self.node.links.subscribe(topic.name, take, depth=depth, raw=True)

    def _checked(self, name: str, kind: type, handle: int, keep: Keep) -> Keep:
        """Return ``keep`` for what can be decoded and is of this run; the rest is counted, reported, not recorded."""
        problem_of, has_run, ours = payload_check(kind), names_run(kind), self.node.run

        def on_message(payload: bytes) -> None:
            problem = problem_of(payload) if len(payload) <= MESSAGE_LIMIT else _TOO_LARGE.format(len(payload))
            if not problem and has_run and (found := head_of(payload)[1]) != ours and is_foreign(found, ours):
                problem = "a message of another run"
            if problem:
                self.bag.refuse(handle)
                self.node.events.warn("not_recorded", f"{name}: {problem}", self._clock.newest)
            else:
                keep(payload)

        return on_message

    def _write(self, handle: int, payload: bytes) -> None:
        self.bag.write(handle, payload, self._clock.newest, time.time_ns())

    def _stepped(self, name: str, handle: int) -> Keep:
        write, steady, wall, clock = self.bag.write, time.monotonic, time.time_ns, self._clock
        followed = name in FOLLOWED

        def keep(payload: bytes) -> None:
            self._arrived = steady()
            stamp = _stamp_of(payload)
            if not clock.accepts(stamp, self._arrived):
                self.bag.refuse(handle)
                text = f"{name}: stamp {stamp} ns is far ahead of the flight; not recorded"
                self.node.events.warn("far_ahead", text, self._clock.newest)
                return
            self._counter.add(name, stamp, self._arrived, self._number)
            write(handle, payload, clock.newest, wall())
            if clock.newest >= self._due_ns:
                self._acknowledge()
            if followed:
                self._poses.take(name, payload, clock.newest)

        return keep

    def _with_status(self, keep: Keep) -> Keep:
        def on_message(payload: bytes) -> None:
            keep(payload)
            status = deserialize_message(payload, NodeStatus)
            if status.role in self.node.roles and not is_foreign(run_number(status.run_id), self.node.run):
                self._periods[status.role] = max(status.period_steps, 1)  # 0: the simulator refuses the flight
                if status.role in SHADOWS and status.state == NodeState.FAULT:
                    self._counter.give_up(
                        name for name, topic in topics.TOPICS.items() if status.role in topic.publishers
                    )

        return on_message

    def _acknowledge(self) -> None:
        """Let the plant go on; held back while the disk is behind."""
        if not (self.node.lockstep and self._ready) or self.bag.backlog > BACKLOG_LIMIT // 4:
            return
        period = self._period
        step = (self._counter.complete_through(time.monotonic()) + 1) // period - 1
        if step < max(self._acked + self.settings.ack_steps, 0):
            return
        self._acked = self.node.current_step = step
        self._due_ns = (step + self.settings.ack_steps) * period
        payload = serialize_message(RecorderAck(step=step, run=self.node.run, dropped=sum(self.bag.dropped.values())))
        self._ack_out.publish(payload)
        self._write(self._ack_handle, payload)

    def _needs(self) -> list[str]:
        """Return the roles whose period is not known yet."""
        return [f"flight/nodes of {role}" for role in self.node.roles if role not in (RECORDER, *self._periods)]

    def activate(self) -> None:
        """Expect a message of every step topic at every step of its publisher; in real time no topic is required."""
        roles = self.node.roles
        steps = {
            name: self._periods[topic.publisher_of(roles)] * self._period
            for name, topic in topics.TOPICS.items()
            if (topic.step or _of_shadow(name)) and topic.publishers[0] in roles and topic.exists(roles)
        }
        optional = [name for name in steps if not (self.node.lockstep and topics.TOPICS[name].required)]
        self._counter = StepCounter(steps, optional, filter(_of_shadow, steps), time.monotonic())
        self._ready = True

    def deactivate(self, ended: FlightState) -> None:
        """Remember the end; ``_watch`` leaves when everything is there."""
        if self._last is None:
            self._last, self._ended = ended, time.monotonic()

    def _watch(self) -> None:
        """Watch the disk and the end of the flight."""
        node = self.node
        if self.bag.error and not node.events.counts["recording_stopped"]:
            node.events.error("recording_stopped", self.bag.error, self._clock.newest)
        self._acknowledge()
        now = time.monotonic()
        silent = now - self._arrived > _SILENCE
        if not node.lockstep:
            node.current_step = self._clock.newest // self._period
            if node.asked_to_end and self._last is None and silent:
                node.finish(1, f"stopped by {node.asked_to_end}, and no node flies any more")
        if self._last is None or node.done.done():
            return
        # Of a flight that failed some messages never come: silence is enough.
        over = (silent and self._last.state == FlightState.FAILED) or self._all_here(self._last.step)
        if now - self._ended > (_GRACE if over else self.settings.finish_timeout):
            self._leave(self._last)

    def _all_here(self, step: int) -> bool:
        stamp, now = step * self._period, time.monotonic()
        if self.node.lockstep:
            return self._counter.complete_through(now) >= stamp
        return self._counter.complete_through(now) >= stamp - _TAIL_NS and now - self._arrived > _GRACE

    def _leave(self, last: FlightState) -> None:
        node, ended = self.node, last.state == FlightState.ENDED
        end = last.step * self._period
        missing = self._counter.missing_through(end)
        silent = [] if node.lockstep else self._counter.silent_through(end - _TAIL_NS)
        counts = ["missing " + ", ".join(f"{count} of {topic}" for topic, count in missing.items())] if missing else []
        listed = "; ".join([*counts, *silent])
        fault = bool(missing) and node.lockstep  # in real time a flight does not wait for its recorder
        if listed:
            say = node.events.info if not fault else node.events.error if ended else node.events.warn
            say("incomplete", listed, self._clock.newest)
        self._close_bag(ended, last.reason, missing)
        problem = self.bag.error or (listed if fault else "")
        if self.bag.error or (ended and problem):
            node.finish(1, problem)
            return
        node.finish(0, f"{self.bag.messages} messages in {self.bag.path.name}")
        node.exit_code = 0 if ended else 1

    def _close_bag(self, ended: bool, reason: str, missing: dict[str, int]) -> None:
        notes = {"outcome": "ended" if ended else "failed", "reason": reason, "last_step": str(self.node.current_step)}
        notes.update({f"missing.{topic}": str(count) for topic, count in missing.items()})
        notes.update({f"count.{name}": str(count) for name, count in sorted(self.node.events.counts.items()) if count})
        self.bag.close(notes)

    def shut_down(self) -> None:
        """Finish the bag of a recorder that was stopped early."""
        self._close_bag(False, STOPPED, {})

    def _measured(self) -> dict[str, float]:
        """Return what waits for the disk and what was dropped."""
        return {"backlog_bytes": self.bag.backlog, "dropped": sum(self.bag.dropped.values())}


def numbered(keep: Keep, take_number: Callable[[int | None], None]) -> Callable[..., None]:
    """Return the callback that calls ``take_number`` with how many messages the publisher had sent, then ``keep``.

    The number counts from 1, and is None where the middleware does not count.
    """

    def on_message(*found: Any) -> None:
        payload, facts = found if len(found) == 2 else found[0]  # rclpy's EventsExecutor gives both as one tuple
        take_number(facts["publication_sequence_number"])
        keep(payload)

    kind = inspect.Parameter.POSITIONAL_ONLY
    parameters = [inspect.Parameter(name, kind) for name in ("payload", "facts")]
    vars(on_message)["__signature__"] = inspect.Signature(parameters)  # rclpy gives the facts to two parameters
    return on_message


def _of_shadow(topic: str) -> bool:
    return topic.startswith(topics.SHADOW_TOPICS)


def _stamp_of(payload: bytes) -> int:
    """Return the stamp in ns with which a message of a step begins."""
    seconds, nanoseconds = _STAMP.unpack_from(payload, 4)
    stamp: int = seconds * 1_000_000_000 + nanoseconds
    return stamp


def main() -> None:
    """Run the recorder node."""
    sys.exit(run(RECORDER, Recorder, "Recorder: writes the topics of a flight into one rosbag2 MCAP bag."))

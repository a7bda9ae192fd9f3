"""The recorder node: every message of a flight into one bag, and flow control for the lockstep."""

import struct
import sys
import time
from collections.abc import Callable
from datetime import datetime, timezone
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.serialization import deserialize_message, serialize_message

from quad_core.parameters import ParameterError
from quad_flight_log.bag_metadata import Qos
from quad_flight_log.bag_writer import BACKLOG_LIMIT, BagWriter
from quad_flight_log.errors import FlightLogError
from quad_flight_log.provenance import flight_metadata
from quad_flight_log.step_tracker import Arrival, StepTracker
from quad_msgs.msg import FlightEvent, FlightState, NodeStatus, RecorderAck
from quad_node import topics
from quad_node.flight_node import FlightNode
from quad_node.interface import interface_hash, versions
from quad_node.main import run

_STAMP = struct.Struct("<iI")
_STEP_DEPTH = 1000
_LATCHED_DEPTH = 64
_SILENCE = 1.0  # s without any message after which a failed flight has no more
_GRACE = 0.15  # s in which the last words of the other nodes still arrive


class Recorder(FlightNode):
    """Writes raw messages; ``log_time`` is the flight's clock, ``publish_time`` the wall clock at reception."""

    def __init__(self) -> None:
        """Create the bag; raises as FlightNode, or ParameterError if the directory cannot be recorded to."""
        super().__init__(topics.RECORDER)
        self.settings = self.resolved.node
        self.bag = self._create_bag()
        self.tracker: StepTracker | None = None
        self._periods: dict[str, int] = {}
        self._flight_ns = 0
        self._acked = -1
        self._due_ns = (self.settings.ack_steps - 1) * self.flight.plant_period
        self._last: FlightState | None = None
        self._ended = self._arrived = 0.0
        self._ack_out = self.publisher("flight/recorded")
        self._ack_handle = self._declare("flight/recorded", topics.TOPICS["flight/recorded"].type, latched=False)
        self._shadow_ns: dict[str, int] = {}
        for topic in topics.TOPICS.values():
            shadow = topic.name.startswith(topics.SHADOW_TOPICS)
            if self.role in topic.subscribers and (not shadow or topic.publishers[0] in self.roles):
                self._record(topic)
        handle = self._declare("/diagnostics", DiagnosticArray, latched=False)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._plain(handle), topics.stream(64), raw=True)

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
        try:
            text = Path(self.settings.parameters_file).read_text("utf-8") if self.settings.parameters_file else ""
            return BagWriter(directory, metadata=flight_metadata(facts, versions()), parameters=text)
        except UnicodeDecodeError as error:
            raise ParameterError(f"parameters_file: {self.settings.parameters_file}: not UTF-8") from error
        except OSError as error:
            raise ParameterError(f"parameters_file: {self.settings.parameters_file}: {error.strerror}") from error
        except FlightLogError as error:
            raise ParameterError(f"directory: {error}") from error

    def _declare(self, name: str, kind: type, latched: bool) -> int:
        module = kind.__module__.split(".")[0]
        qos = Qos(1, durability="transient_local") if latched else Qos(10)
        return self.bag.add_topic(self.resolve_topic_name(name), f"{module}/msg/{kind.__name__}", qos)

    def _record(self, topic: topics.Topic) -> None:
        handle = self._declare(topic.name, topic.type, topic.latched)
        if topic.step:
            self.subscribe(topic.name, self._stepped(topic.name, handle), depth=_STEP_DEPTH, raw=True)
            return
        keep = self._plain(handle)
        if topic.name == "flight/nodes":
            keep = self._with_status(keep)
        elif topic.name.startswith(topics.SHADOW_TOPICS):
            self._shadow_ns[topic.name] = -1
            keep = self._with_stamp(topic.name, keep)
        self.subscribe(topic.name, keep, depth=_LATCHED_DEPTH if topic.latched else _STEP_DEPTH, raw=True)

    def _plain(self, handle: int) -> Callable[[bytes], None]:
        def keep(payload: bytes) -> None:
            self._arrived = time.monotonic()
            self.bag.write(handle, payload, self._flight_ns, time.time_ns())

        return keep

    def _stepped(self, name: str, handle: int) -> Callable[[bytes], None]:
        unpack, write, steady, wall = _STAMP.unpack_from, self.bag.write, time.monotonic, time.time_ns

        def keep(payload: bytes) -> None:
            self._arrived = steady()
            seconds, nanoseconds = unpack(payload, 4)
            stamp = seconds * 1_000_000_000 + nanoseconds
            if self.tracker is not None:
                kind = self.tracker.add(name, stamp, payload)
                if kind is not Arrival.NEW:
                    self._unusual(name, stamp, kind)
                    if kind is not Arrival.OFF_STEP:
                        return
            if stamp > self._flight_ns:
                self._flight_ns = stamp
            write(handle, payload, self._flight_ns, wall())
            if self._flight_ns >= self._due_ns:
                self._acknowledge()

        return keep

    def _with_status(self, keep: Callable[[bytes], None]) -> Callable[[bytes], None]:
        def hear(payload: bytes) -> None:
            keep(payload)
            status = deserialize_message(payload, NodeStatus)
            ours = not (self.flight.run_id and status.run_id) or status.run_id == self.flight.run_id
            if ours and status.role in self.roles:
                self._periods[status.role] = status.period_steps

        return hear

    def _with_stamp(self, name: str, keep: Callable[[bytes], None]) -> Callable[[bytes], None]:
        def hear(payload: bytes) -> None:
            keep(payload)
            seconds, nanoseconds = _STAMP.unpack_from(payload, 4)
            self._shadow_ns[name] = seconds * 1_000_000_000 + nanoseconds

        return hear

    def _unusual(self, name: str, stamp: int, kind: Arrival) -> None:
        if kind is Arrival.CONFLICT:
            text = f"{name}: a second, different message for stamp {stamp} ns; not recorded"
            self.event(FlightEvent.ERROR, "conflict", text, stamp)
        elif kind is Arrival.OFF_STEP:
            self.event(FlightEvent.WARNING, "off_step", f"{name}: stamp {stamp} ns is none of its steps", stamp)
        else:
            self.counters["repeat"] += 1
            if name == "state":
                self._acknowledge(again=True)

    def _acknowledge(self, again: bool = False) -> None:
        """Let the plant go on; held back while the disk is behind."""
        if self.tracker is None or self.bag.backlog > BACKLOG_LIMIT // 4:
            return
        complete = self.tracker.complete_through()
        if complete < 0 or not (again or complete >= self._acked + self.settings.ack_steps):
            return
        self._acked = self.step = complete
        self._due_ns = (complete + self.settings.ack_steps) * self.flight.plant_period
        dropped = sum(self.bag.dropped.values()) + self.counters["conflict"]
        payload = serialize_message(RecorderAck(step=complete, dropped=dropped))
        self._ack_out.publish(payload)
        self.bag.write(self._ack_handle, payload, self._flight_ns, time.time_ns())

    def missing_links(self) -> list[str]:
        """Return unmatched topics and the roles whose period is not known yet."""
        return super().missing_links() + [
            f"flight/nodes of {role}" for role in self.roles if role not in (self.role, *self._periods)
        ]

    def on_ready(self) -> None:
        """Expect a message of every step topic at every step of its publisher."""
        if not self.lockstep:
            return
        periods = {
            topic.name: self._periods[topic.publishers[0]]
            for topic in topics.TOPICS.values()
            if topic.step and topic.publishers[0] in self.roles
        }
        self.tracker = StepTracker(periods, self.flight.plant_period)

    def on_flight_ended(self, message: FlightState) -> None:
        """Remember the end; ``on_tick`` leaves when everything is there."""
        if self._last is None:
            self._last, self._ended = message, time.monotonic()

    def on_tick(self) -> None:
        """Watch the disk and the end of the flight."""
        if self.bag.error and not self.counters["recording_stopped"]:
            self.event(FlightEvent.ERROR, "recording_stopped", self.bag.error, self._flight_ns)
        self._acknowledge()
        if self._last is None or self.done.done():
            return
        now = time.monotonic()
        # Of a flight that failed some messages never come: silence is enough.
        quiet = self._last.state == FlightState.FAILED and now - self._arrived > _SILENCE
        patience = _GRACE if quiet or self._all_here(self._last.step) else self.settings.finish_timeout
        if now - self._ended > patience:
            self._leave(self._last)

    def _all_here(self, step: int) -> bool:
        if self.tracker is None:
            return time.monotonic() - self._arrived > _GRACE
        return self.tracker.complete_through() >= step and all(
            stamp >= self._last_due(name, step) for name, stamp in self._shadow_ns.items()
        )

    def _last_due(self, name: str, step: int) -> int:
        period = self._periods[topics.TOPICS[name].publishers[0]]
        return step // period * period * self.flight.plant_period

    def _leave(self, last: FlightState) -> None:
        missing = self.tracker.missing_through(last.step) if self.tracker else {}
        ended = last.state == FlightState.ENDED
        lost = ", ".join(f"{count} of {topic}" for topic, count in missing.items())
        problem = f"missing {lost}" if lost else ""
        if problem:
            self.event(FlightEvent.ERROR if ended else FlightEvent.WARNING, "incomplete", problem, self._flight_ns)
        report = self.bag.close(self._end_metadata(ended, last.reason, missing, last.wall_time))
        conflicts = self.counters["conflict"]
        problem = report.error or problem or (f"{conflicts} conflicting messages" if conflicts else "")
        if report.error or (ended and problem):
            self.finish(1, problem)
            return
        self.finish(0, f"{report.messages} messages in {report.path.name}")
        self.exit_code = 0 if ended else 1

    def _end_metadata(self, ended: bool, reason: str, missing: dict[str, int], wall_time: float) -> dict[str, str]:
        found = {"outcome": "ended" if ended else "failed", "reason": reason, "steps": str(self.step)}
        if wall_time > 0.0:
            found["wall_time"] = f"{wall_time:.6f}"
            found["real_time_factor"] = f"{self._flight_ns * 1e-9 / wall_time:.3f}"
        found.update({f"missing.{topic}": str(count) for topic, count in missing.items()})
        found.update({f"count.{name}": str(count) for name, count in sorted(self.counters.items()) if count})
        return found

    def close(self) -> None:
        """Finish the bag of a recorder that was stopped early."""
        self.bag.close(self._end_metadata(False, "recorder stopped before the end of the flight", {}, 0.0))

    def measurements(self) -> dict[str, float]:
        """Return what waits for the disk and what was dropped."""
        return {"backlog_bytes": self.bag.backlog, "dropped": sum(self.bag.dropped.values())}


def main() -> None:
    """Run the recorder node."""
    sys.exit(run(topics.RECORDER, Recorder, "Recorder: writes every topic of a flight into one rosbag2 MCAP bag."))

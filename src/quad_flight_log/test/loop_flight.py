"""A flight of the loop without ROS as the messages that the nodes would have sent, encoded by rosbags."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import flight_samples
import numpy as np
import yaml
from flight_samples import TYPES, of_row, time_of

from quad_core.cascade import SIGNALS, STAGE
from quad_core.resolution import Resolved
from quad_core.roles import Stage
from quad_flight.flight import Flight, Result, flight_from_parameters, fly


class FlownFlight(NamedTuple):
    """What was flown: parameters and result of the loop, and (topic, message) in the order of a bag."""

    flight: Flight
    result: Result
    messages: list[tuple[str, Any]]


def fly_short(duration: float = 1.0, disturbance: str = "") -> FlownFlight:
    """Fly Case 1 from the origin for ``duration`` s: thrust and tilt meet their limits on the way."""
    overrides = {"trajectory": {"trajectory": "case1", "case1.start": "printed", "case1.duration": duration}}
    overrides |= {"simulator": {"disturbance": disturbance}} if disturbance else {}
    flight = flight_from_parameters(overrides)
    result = fly(flight)
    assert result.outcome == "ended"
    rows = [(int(row["stamp_ns"]), topic, of_row(topic, row)) for topic in TYPES for row in result.topics[topic]]
    for _, topic, sample in rows:
        if topic.endswith("/internals"):
            _note_inputs(STAGE[topic.partition("/")[0]], flight.resolved, sample)
    rows += [(int(row["stamp_ns"]), "odom", _odometry(row)) for row in result.topics["truth"][::10]]
    rows.append((0, "/diagnostics", _diagnostics()))
    rows.append((0, "flight/events", flight_samples.event(0, "größer")))
    last = int(result.topics["truth"]["stamp_ns"][-1])
    guard = flight_samples.message("quad_msgs/msg/GuardStatus", stamp=time_of(0))
    rows += [(0, "flight/guard", guard), (last, *flight_samples.over(last // flight_samples.STEP_NS))]
    rows.sort(key=lambda item: item[0])
    messages = [("flight/parameters", said) for said in parameters_said(flight)]
    return FlownFlight(flight, result, messages + [(topic, sample) for _, topic, sample in rows])


def parameters_said(flight: Flight) -> list[Any]:
    """Return what the nodes publish on flight/parameters."""
    found = []
    for role, resolved in flight.resolved.items():
        values = {field.name: field.default for field in resolved.all_fields()}
        text = yaml.safe_dump({f"/{role}": {"ros__parameters": values}})
        found.append(
            flight_samples.message("quad_msgs/msg/NodeParameters", node=f"/{role}", role=role, parameters=text)
        )
    return found


def _odometry(row: np.void) -> Any:
    place, turn = (dict(zip("xyzw", row[name].tolist(), strict=False)) for name in ("p_w", "q_wb"))
    return flight_samples.message(
        "nav_msgs/msg/Odometry",
        header={"stamp": time_of(int(row["stamp_ns"])), "frame_id": "world"},
        child_frame_id="base_link",
        pose={"pose": {"position": place, "orientation": turn}},
    )


def _note_inputs(stage: Stage, resolved: Mapping[str, Resolved], sample: Any) -> None:
    """Write into internals what their law had: the setpoint that holds at its step, the actuation before it."""
    sample.dt = resolved[stage.role].node.period_steps * 0.002
    for place, taken in enumerate(stage.inputs):
        period = 1 if taken.lag else resolved[SIGNALS[taken.topic].publisher].node.period_steps
        sample.input_steps[place] = (sample.step - taken.lag) // period * period


def _diagnostics() -> Any:
    pairs = [flight_samples.message("diagnostic_msgs/msg/KeyValue", key=key, value="1") for key in "ab"]
    status = [
        flight_samples.message("diagnostic_msgs/msg/DiagnosticStatus", level=level, name=f"node {level}", values=pairs)
        for level in (0, 1)
    ]
    return flight_samples.message("diagnostic_msgs/msg/DiagnosticArray", status=status)


def write_flight(directory: Path, flown: FlownFlight, *, replace: dict[int, Any] | None = None) -> Path:
    """Write ``flown`` as a bag and return its directory; ``replace``: {index in messages: other message}."""
    changed = replace or {}
    messages = [
        (f"/{topic.lstrip('/')}", changed.get(index, sample)) for index, (topic, sample) in enumerate(flown.messages)
    ]
    flight_samples.write_bag(directory, messages, log_ns=log_time)
    return directory


def log_time(index: int, sample: Any) -> int:
    """Return the stamp of a message in ns, 0 where it has none."""
    stamp = getattr(sample, "stamp", None) or getattr(getattr(sample, "header", None), "stamp", None)
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec) if stamp else 0

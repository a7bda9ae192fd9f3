"""Small made-up flights for figures, reports and viewers: a circle with a known error, as tables and as a bag."""

import base64
from pathlib import Path
from typing import Any

import flight_samples
import metric_tables
import numpy as np

from quad_report.flight_figures import Run, run_from_tables

PERIOD_NS = 10_000_000
APPROACH = 2.0  # s
OFFSET = np.array([0.3, -0.2, 0.1])  # m, flown minus reference
YAW_ERROR = 0.05  # rad


def _table(steps: int, **columns: Any) -> np.ndarray:
    return metric_tables.table(np.arange(steps) * PERIOD_NS, step=np.arange(steps), **columns)


def circle(steps: int) -> np.ndarray:
    """Return points (steps, 3) in m on a climbing circle of radius 2 m."""
    angle = np.arange(steps) * 0.01
    return np.stack([2.0 * np.cos(angle), 2.0 * np.sin(angle), 0.1 * angle], axis=1)


def tables(steps: int = 600, scale: float = 1.0) -> dict[str, np.ndarray]:
    """Return the tables of a flight whose error is ``scale * OFFSET`` all along."""
    times = np.arange(steps) * PERIOD_NS * 1e-9 - APPROACH
    points, zeros = circle(steps), np.zeros((steps, 3))
    yaw = np.full(steps, 0.4)
    flown_yaw = yaw + YAW_ERROR
    q_wb = np.stack([0 * yaw, 0 * yaw, np.sin(flown_yaw / 2), np.cos(flown_yaw / 2)], axis=1)
    angles = np.stack([0 * yaw, 0 * yaw, yaw], axis=1)
    no = np.zeros(steps, bool)
    return {
        "truth": _table(steps, p_w=points + scale * OFFSET, v_w=zeros, q_wb=q_wb, omega_b=zeros),
        "reference": _table(steps, trajectory_time=times, p_w=points, v_w=zeros, yaw=yaw),
        "attitude_setpoint": _table(steps, angles=angles, thrust=np.full(steps, 5.5)),
        "wrench_setpoint": _table(steps, thrust=np.full(steps, 5.5), torque_b=0.01 * points),
        "actuation": _table(steps, thrust=np.full(steps, 5.25), thrust_high=~no, thrust_low=no, roll_limited=~no,
                            pitch_limited=no, yaw_limited=no),
        "disturbance": _table(steps, force_w=zeros + 0.25, lumped_acceleration_w=zeros + 0.5),
        "position_controller/internals": _table(steps, adaptive_gain=points + 5.0, disturbance_estimate=zeros + 0.4,
                                                lyapunov=np.abs(times), lyapunov_rate=-np.abs(times)),
        "attitude_controller/internals": _table(steps, sliding_variable=0.1 * points),
    }  # fmt: skip


def run(name: str, trajectory: str = "case1", scale: float = 1.0, steps: int = 600) -> Run:
    """Return such a flight as a run."""
    return run_from_tables(name, trajectory, tables(steps, scale))


def bag(directory: Path, trajectory: str = "case1", steps: int = 120, scale: float = 1.0) -> Path:
    """Write such a flight as a bag with the messages of the real topics; returns the bag directory."""
    flight_samples.write_bag(directory, messages(tables(steps, scale), trajectory))
    return directory


def messages(made: dict[str, np.ndarray], trajectory: str = "case1") -> list[tuple[str, Any]]:
    """Return (topic, message) of such tables, with a plan and an event."""
    flown: list[tuple[str, Any]] = []
    plan = flight_samples.message("quad_msgs/msg/FlightPlan", trajectory=trajectory, start="approach")
    flown.append(("/flight/plan", plan))
    event = flight_samples.message("quad_msgs/msg/FlightEvent", node="/simulator", kind="wind", text="<b>gust</b> & 1")
    flown.append(("/flight/events", event))
    for step in range(len(made["truth"])):
        flown += [(f"/{topic}", flight_samples.of_row(topic, table[step])) for topic, table in made.items()]
    flown.append(flight_samples.over(len(made["truth"]) - 1))
    return flown


def decoded(column: dict[str, str]) -> np.ndarray:
    """Return the numbers of a column of a drawn line, as plotly.js reads them."""
    assert column["dtype"] == "f4"
    return np.frombuffer(base64.b64decode(column["bdata"]), "<f4")

"""Whole flights of every plug-in that compiles: the compiled loop has the bits of the Python loop."""

from itertools import cycle, islice

import pytest

from quad_core import plugins
from quad_flight.flight import fly, from_names

pytest.importorskip("numba")

WAYPOINTS = "trajectory.waypoints.points=0 0 0.5 0; 0.5 0 1 0.3; 0.5 0.5 1 0.6"
EVENTS = """simulator.timeline.events=wind velocity=1,0,0
gust start=0.1 end=0.3 velocity=0,3,0
dryden wind=5 airspeed=5 direction=0.5
held_gaussian start=0.1 end=0.4 hold=0.05
push start=0.2 end=0.25 force=0.5,0,0.2 torque=0.01,0,0
payload start=0.2 end=0.4 mass=0.05
rotor start=0.15 number=3 effectiveness=0.9
battery start=0.1 limit=0.8 sag=0.2
freeze start=0.3 end=0.32
jump start=0.35 offset=0.1,0,0 yaw=0.1
link start=0.1 end=0.4 delay=0.004 jitter=0.004 drop=0.1"""

ERRORS = """simulator.sensor.delay=0.01
simulator.sensor.period_steps=2
simulator.sensor.position_noise=0.002
simulator.sensor.velocity_bias=0.01
simulator.sensor.attitude_bias=0.005"""
"""Of the sensor: samples every second step, noise and bias."""


def compiling(group):
    """Return the installed plug-ins of a group that do not say that Numba cannot compile them."""
    return [name for name in plugins.names(group) if getattr(plugins.load(group, name), "COMPILES", True)]


GROUPS = (
    plugins.POSITION_LAW,
    plugins.ATTITUDE_LAW,
    plugins.TRAJECTORY,
    plugins.PLANT,
    plugins.DISTURBANCE,
    plugins.SENSING,
)
NAMES = [compiling(group) for group in GROUPS]
FLIGHTS = list(zip(*(islice(cycle(names), max(map(len, NAMES))) for names in NAMES), strict=True))
"""As few flights as give every plug-in one."""


def settings(trajectory, plant, disturbance, sensing, predicted):
    """Return what plug-ins need for a flight, errors of plant and sensor, and with ``predicted`` predicted states."""
    found = [f"simulator.disturbance={disturbance}", f"simulator.sensing={sensing}"]
    found += [WAYPOINTS] if trajectory == "waypoints" else []
    found += [EVENTS] if disturbance == "timeline" else []
    found += ERRORS.splitlines() if sensing == "sensor" else []
    if plant in ("paper", "rigid_body"):
        errors = ("mass_error=0.02", "inertia_error.xx=0.0003", "drag_error=0.01")
        found += [f"simulator.{plant}.{error}" for error in errors]
    if plant == "rigid_body":
        found.append("simulator.rigid_body.lag_error=0.01")
    if predicted:
        found += [f"{role}.prediction.enabled=true" for role in ("position_controller", "attitude_controller")]
    return found


CASES = [(names, False) for names in FLIGHTS] + [(FLIGHTS[0], True)]


@pytest.mark.parametrize(
    ("names", "predicted"), CASES, ids=["-".join(names) + "-predicted" * predicted for names, predicted in CASES]
)
def test_a_compiled_flight_has_the_bits_of_python(names, predicted, tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("t,x,y,z\n0,0,0,0.5\n0.2,0,0,0.5\n0.4,0.01,0,0.51\n0.6,0.01,0,0.51\n", encoding="utf-8")
    position, attitude, trajectory, plant, disturbance, sensing = names
    from_file = [f"trajectory.file.path={path}"] if trajectory == "file" else []
    flight = from_names(
        trajectory,
        position=position,
        attitude=attitude,
        plant=plant,
        settings=[*settings(trajectory, plant, disturbance, sensing, predicted), *from_file],
        vehicle="x500" if predicted else "paper",
        duration=None if trajectory in ("waypoints", "file") else 0.5,
    )
    plain, fast = fly(flight), fly(flight, compiled=True)
    assert plain.steps > 100
    assert plain._replace(topics={}) == fast._replace(topics={})
    assert set(plain.topics) == set(fast.topics)
    for name, rows in plain.topics.items():
        assert rows.tobytes() == fast.topics[name].tobytes(), name

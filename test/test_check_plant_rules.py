"""check_plant names the rule that a vehicle breaks, and always ends.

What single messages can break: src/quad_dynamics/test/test_check_plant_rules.py.
"""

import math
import time
import zlib

import pytest
import rclpy
from flying import ROOT
from own_node import loaded
from rclpy.executors import SingleThreadedExecutor

from quad_bringup.domains import reserved_domain
from quad_dynamics.check_plant import node as check
from quad_dynamics.check_plant.rules import Report
from quad_msgs.msg import Actuation, FlightState, NodeStatus, VehicleState

pytestmark = pytest.mark.flight

Vehicle = loaded(ROOT / "examples/own_nodes/vehicle.py").Vehicle
LONGEST = 90.0
SETTINGS = (
    "flight.roles:=simulator,attitude_controller", "flight.plant_period:=10000000", "flight.start_timeout:=3.0",
    "flight.run_id:=mine",
)  # fmt: skip


@pytest.fixture(autouse=True)
def hurried(monkeypatch):
    """Let the check wait a shorter time for what will never come."""
    monkeypatch.setattr(check, "_ANSWER", 5.0)  # longer than the silence that ends a check
    monkeypatch.setattr(check, "_END", 5.0)


def checked(vehicle, *settings):
    """Return the report on a vehicle (None: nobody) and how long the check took in s."""
    words = [word for setting in (*SETTINGS, *settings) for word in ("-p", setting)]
    with reserved_domain(None) as domain:
        rclpy.init(args=["--ros-args", *words], domain_id=domain)
        try:
            report = Report()
            checks = check.PlantCheck(report)
            nodes = [checks.ros, *([vehicle()] if vehicle else [])]
            executor = SingleThreadedExecutor()
            for each in nodes:
                executor.add_node(each)
            began = time.monotonic()
            while not checks.done.done() and time.monotonic() - began < LONGEST:
                executor.spin_once(timeout_sec=0.1)
            took = time.monotonic() - began
            for each in nodes:
                executor.remove_node(each)
                each.destroy_node()
        finally:
            rclpy.try_shutdown()
    return report, took


def altered(**methods):
    """Return a vehicle of which some methods are others."""
    return type("Altered", (Vehicle,), methods)


class Sends(Vehicle):
    """A vehicle whose messages ``change`` alters just before they go out; it returns False for one that is lost."""

    def __init__(self):
        self.count = 0
        super().__init__()

    def create_publisher(self, kind, topic, qos, **options):
        found = super().create_publisher(kind, topic, qos, **options)
        publish = found.publish
        if kind in (VehicleState, Actuation, FlightState, NodeStatus):
            found.publish = lambda message: self.change(message) is not False and publish(message)
        return found


def losing(lost):
    return type("Losing", (Sends,), {"change": lambda self, message: not lost(self, message)})


def takes_any_step(self, message):
    message.header.stamp = self.stamp(self.step)
    Vehicle.on_wrench(self, message)


def takes_anything(self, message):
    stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
    if stamp == self.step * self.period:
        self.wrench = [message.wrench.force.z, 0.0, 0.0, 0.0] if math.isfinite(message.wrench.force.z) else [0.0] * 4
        self.go_on()


def repeats(self):
    Vehicle.on_tick(self)
    if self.phase == FlightState.FLYING and self.quiet == 2:
        self.publish_state()


def of_another_run(self, message):
    """Sends as a vehicle that was started with flight.run_id yours, and takes every node for its own."""
    if isinstance(message, (FlightState, NodeStatus)):
        message.run_id = "yours"
    else:
        message.run = zlib.crc32(b"yours")


def never_ends(self, phase, reason=""):
    pass


class Twice(Vehicle):
    """A domain in which somebody else sends states, too."""

    def __init__(self):
        super().__init__()
        self.create_publisher(VehicleState, "state", 10)


BROKEN = {
    "two vehicles": (Twice, "the vehicle sends state 0 once all are READY"),
    "no state": (losing(lambda _, m: isinstance(m, VehicleState)), "the vehicle sends state 0 once all are READY"),
    "repeats": (altered(on_tick=repeats), "the state of a step comes once"),
    "takes any step": (altered(on_wrench=takes_any_step), "a command for another step is ignored"),
    "takes what is not finite": (altered(on_wrench=takes_anything), "a command that is not finite is ignored"),
    "dies": (losing(lambda self, _: self.step > 20), "flight/state comes once a second"),
    "flies on": (altered(end=never_ends), "a silent controller ends the flight as FAILED, named"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_broken_rule_is_named_and_the_check_ends(fault):
    vehicle, rule = BROKEN[fault]
    report, took = checked(vehicle)
    assert rule in report.broken, report.text()
    assert took < LONGEST, report.text()


def test_a_vehicle_of_another_run_is_named():
    report, _ = checked(type("Yours", (Sends,), {"change": of_another_run}))
    said = "flight/nodes of /simulator has run_id 'yours', expected 'mine'"
    assert said in report.broken["the vehicle says READY on flight/nodes"], report.text()
    assert "flight/state comes once a second" not in report.broken


def other_messages(self, message):
    if isinstance(message, NodeStatus):
        message.interface_hash = "f00"


def test_a_vehicle_that_was_built_with_other_messages_ends_the_check():
    report, _ = checked(type("Older", (Sends,), {"change": other_messages}))
    (said,) = report.broken.values()
    assert "simulator was built with other quad_msgs: found f00, expected" in said


def test_without_a_run_id_no_rule_speaks_of_it():
    report, _ = checked(losing(lambda self, _: self.step > 0), "flight.run_id:=''")
    assert "ok    the first state is step 0" in report.text()
    assert "run of state" not in report.text()


@pytest.mark.parametrize("mode", ["lockstep", pytest.param("realtime", marks=pytest.mark.wall_clock)])
def test_the_vehicle_of_the_examples_keeps_every_rule(mode, monkeypatch):
    monkeypatch.setattr(check, "_ANSWER", 10.0)
    report, _ = checked(Vehicle, f"flight.mode:={mode}", "flight.start_timeout:=30.0")
    assert not report.broken, report.text()

"""A controller with a standby, or the standby, and what it receives of the other one."""

from contextlib import contextmanager

import rclpy
from rclpy.serialization import serialize_message

from quad_core.types import Quat, Vec3, VehicleState
from quad_msgs.msg import AttitudeThrust, Takeover
from quad_node import executor
from quad_node.responder import LawNode, Sample

SHADOW, MAIN = "shadow_position_controller", "position_controller"
ROLES = f"simulator,trajectory,position_controller,attitude_controller,recorder,{SHADOW}"
INSIDE = "position_controller/internals"
STILL = VehicleState(Vec3(), Vec3(), Quat(0.0, 0.0, 0.0, 1.0), Vec3())


@contextmanager
def controllers(monkeypatch):
    """Give a function that makes a position controller, or its shadow, with the given ROS parameters."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "71")
    nodes = []

    def built(*words, shadow=True):
        name = ["-r", f"__node:={SHADOW}"] if shadow else []
        given = [
            word
            for each in (f"flight.roles:={ROLES}", "flight.mode:=realtime", "flight.standby:=true", *words)
            for word in ("-p", each)
        ]
        executor.init(["--ros-args", *name, *given])
        nodes.append(LawNode(MAIN))
        return nodes[-1]

    yield built
    for node in nodes:
        node.ros.destroy_node()
    rclpy.try_shutdown()


def answered(node, step):
    """Let ``node`` answer ``step``."""
    return list(node.answer(Sample(step, step * 2_000_000, STILL, 0.01), [None, None]))


def topics_of(node, step):
    """Return on which topics the answer to ``step`` is sent."""
    return [publisher.topic_name for publisher, _ in answered(node, step)]


def heard(node, step, run=0):
    """Let the other controller have answered ``step``."""
    node.standby._on_answer(serialize_message(AttitudeThrust(step=step, run=run)))


def warm(node, begin=0, seconds=2.0):
    """Let ``node`` stand by for some time; returns the first step after it."""
    end = begin + int(seconds * 500)
    for step in range(begin, end + 1, 5):
        heard(node, step)
        assert topics_of(node, step) == ([] if node.ros.get_name() == MAIN else ASIDE)
    return end + 5


def called(node):
    """Return whether a request is accepted, and what is said."""
    response = node.standby._on_call(None, Response())
    return response.success, response.message


def told(node, role, step, memory_step=0, sender="/other", run_id=""):
    """Let a message on flight/takeover arrive."""
    message = Takeover(node=sender, role=role, step=step, memory_step=memory_step, run_id=run_id, detail="why")
    node.standby._on_takeover(message)


class Response:
    """Stands in for the response of a service."""

    success, message = False, ""


FLYING = ["/attitude_setpoint", "/position_controller/internals"]
ASIDE = ["/shadow/attitude_setpoint", "/shadow/position_controller/internals"]
BOTH = [FLYING[0], ASIDE[0], FLYING[1], ASIDE[1]]

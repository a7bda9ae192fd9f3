"""The file of each node names what it subscribes and publishes, with the message types, as its node does in a graph."""

import importlib
import re

import pytest
import rclpy

from quad_bringup.surroundings import reserved_domain
from quad_node import executor

pytestmark = pytest.mark.ros

EVERY = {
    "subscribed": {"/flight/state": "FlightState"},
    "published": {
        "/flight/nodes": "NodeStatus",
        "/flight/events": "FlightEvent",
        "/flight/parameters": "NodeParameters",
    },
}
OF_RCLPY = ("/rosout", "/parameter_events", "/diagnostics")
ROLES = "simulator,trajectory,position_controller,attitude_controller,recorder"
NODES = {
    "simulator": ("quad_dynamics.node", "Simulator"),
    "trajectory": ("quad_trajectory.node", "Trajectory"),
    "position_controller": ("quad_position_ctrl.node", "make"),
    "attitude_controller": ("quad_attitude_ctrl.node", "make"),
}


def named(text, words):
    """Return {topic: type} of the sentence of a docstring that begins with ``words``."""
    found = re.search(rf"^{words}: (.*?)\.$", text, re.MULTILINE | re.DOTALL)
    return {f"/{topic}": kind for topic, kind in re.findall(r"([\w/]+) \((\w+)\)", found[1] if found else "")}


def without_services(topics):
    kinds = {name: types[0].rpartition("/")[2] for name, types in topics}
    return {name: kind for name, kind in kinds.items() if name not in OF_RCLPY}


@pytest.mark.parametrize("commanded", [False, True], ids=["bare", "commanded"])
@pytest.mark.parametrize("role", NODES)
def test_a_node_s_file_names_its_topics(role, commanded, monkeypatch):
    module_name, maker = NODES[role]
    module = importlib.import_module(module_name)
    text = module.__doc__
    subscribed, published = named(text, "Subscribes"), named(text, "Publishes")
    if commanded:
        subscribed |= named(text, "With a commander it subscribes also")
        published |= named(text, "With a commander it publishes also")
        instead = named(text, "With a commander it publishes instead")
        published = instead or published
    if role != "simulator":
        subscribed |= EVERY["subscribed"]
    published |= EVERY["published"]
    with reserved_domain(None) as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        roles = f"{ROLES},commander" if commanded else ROLES
        executor.init(["--ros-args", "-p", f"flight.roles:={roles}"])
        try:
            node = getattr(module, maker)().node.ros
            name, space = node.get_name(), node.get_namespace()
            assert without_services(node.get_subscriber_names_and_types_by_node(name, space)) == subscribed
            assert without_services(node.get_publisher_names_and_types_by_node(name, space)) == published
            node.destroy_node()
        finally:
            rclpy.try_shutdown()

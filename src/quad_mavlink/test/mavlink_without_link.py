"""The bridge over MAVLink without node, library and link: what it sends is noted."""

from types import SimpleNamespace
from unittest.mock import Mock, patch

from quad_autopilot.autopilot import Stamps
from quad_core.vehicle import Vehicle
from quad_mavlink import link
from quad_mavlink.node import MavlinkInterface


class Words:
    """Stands for pymavlink: each message is its name and its arguments."""

    def __getattr__(self, name):
        return lambda *fields, **_: (name.removeprefix("MAVLink_").removesuffix("_message"), *fields)


def bridge(settings):
    """Return the interface of a bridge with ``settings``; ``sent`` is what it has sent."""
    sent = []
    node = Mock(settings=settings, vehicle=Vehicle(mass=1.0), phase=0, sample=None)
    node.stamps.return_value = Stamps()
    wire = SimpleNamespace(mavlink=Words(), send=sent.append)
    with patch.object(link, "load"), patch.object(link, "Link", return_value=wire):
        made = MavlinkInterface(node)
    made.sent = sent
    return made

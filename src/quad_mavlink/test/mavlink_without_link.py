"""The bridge over MAVLink without node, library and link: what it sends is noted."""

from types import SimpleNamespace
from unittest.mock import Mock, patch

from quad_autopilot.autopilot import Stamps
from quad_core.vehicle import Vehicle
from quad_mavlink import link
from quad_mavlink import node as module


class Words:
    """Stands for pymavlink: each message is its name and its arguments."""

    def __getattr__(self, name):
        return lambda *fields, **_: (name.removeprefix("MAVLink_").removesuffix("_message"), *fields)


def bridge(settings):
    """Return a bridge with ``settings``; ``sent`` is what it has sent."""
    sent = []
    flight = Mock(settings=settings, is_over=False, sample=None, said=None, ack=None)
    flight.node.vehicle = Vehicle(mass=1.0)
    flight.stamps.return_value, flight.clock.return_value = Stamps(), 0.0
    wire = SimpleNamespace(mavlink=Words(), send=sent.append)
    with (
        patch.object(link, "load"),
        patch.object(link, "Link", return_value=wire),
        patch.object(module, "AutopilotFlight", return_value=flight),
    ):
        made = module.MavlinkBridge()
    made.sent = sent
    return made

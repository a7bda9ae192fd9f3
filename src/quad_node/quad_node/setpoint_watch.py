"""Real time without a commander: whether the reference and the setpoints between the controllers still come.

The guard sees wrenches alone, and a controller that has lost its input goes on sending: the vehicle stays level and
drifts, or brakes to the last reference. With a commander it decides (docs/explanation/safety.md); else the vehicle's
owner gives up.
"""

import time
from collections.abc import Callable
from functools import partial

from quad_core.cascade import COMMAND, STAGES, TRAJECTORY
from quad_core.cycle import seconds
from quad_node.codec import head_of
from quad_node.flight_node import FlightNode

_STOOD_STILL = 0.2  # s between two looks, which are 0.05 s apart
_PERIODS = 3.0  # of a slow controller that may pass all the same


class SetpointWatch:
    """When the reference and each setpoint came last, and which node is silent."""

    def __init__(self, node: FlightNode, period_of: Callable[[str], int]) -> None:
        """Listen for ``node``; ``period_of`` gives the period of a role in plant steps."""
        self._node, self._period_of = node, period_of
        self._heard: dict[str, float] = {}
        self._looked = 0.0
        given = {"reference": TRAJECTORY, **{stage.gives: stage.role for stage in STAGES if stage.gives != COMMAND}}
        if node.lockstep or node.commanded:
            given = {}
        self._watched = {topic: role for topic, role in given.items() if role in node.roles}
        for topic in self._watched:
            node.subscribe(topic, partial(self._on_setpoint, topic), raw=True)

    def rest(self) -> None:
        """Report nothing: for a vehicle interface whose time waits for its controllers, however slow."""
        self._watched = {}

    def silent(self, asked_at: float) -> str:
        """Return which node is silent and since when, empty if none is.

        ``asked_at``: steady s at which the newest state was published: without a state there is nothing to answer. A
        setpoint is missed once it has come.
        """
        now = time.monotonic()
        slept, self._looked = now - self._looked, now
        if slept > _STOOD_STILL:  # this process slept: what it missed is still to be read
            self._heard = {topic: min(heard + slept, now) for topic, heard in self._heard.items()}
        flight = self._node.flight
        for topic, role in self._watched.items():
            period = seconds(self._period_of(role), flight.plant_period)
            longest = flight.reference_timeout if role == TRAJECTORY else flight.setpoint_timeout
            limit = max(longest, _PERIODS * period)
            if asked_at - self._heard.get(topic, now) > limit:
                return f"{role} does not answer: {topic} older than {limit:g} s"
        return ""

    def _on_setpoint(self, topic: str, payload: bytes) -> None:
        if not self._node.is_foreign(topic, head_of(payload)[1]):
            self._heard[topic] = time.monotonic()

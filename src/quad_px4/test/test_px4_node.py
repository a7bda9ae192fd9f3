"""What the bridge to PX4 does beside its messages."""

from types import SimpleNamespace

import pytest

from quad_autopilot.autopilot_flight import Taken
from quad_px4.node import Px4Bridge


@pytest.mark.parametrize("taken_over", [False, True])
def test_where_px4_moves_its_estimate_the_guard_begins_anew_unless_it_flies(taken_over):
    rested, taken = [], Taken(accepted=True, published=True, shifted=True)
    guard = SimpleNamespace(taken_over=taken_over, rest=rested.append)
    bridge = SimpleNamespace(
        flight=SimpleNamespace(clock=lambda: 1.0, take=lambda _: taken),
        leader=SimpleNamespace(guard=guard),
        node=SimpleNamespace(current_step=7),
        _guarded_step=3,
        _is_state_new=False,
    )
    assert Px4Bridge.take_estimate(bridge, None) == taken
    assert (rested, bridge._guarded_step) == (([], 3) if taken_over else ([7], -1))
    assert bridge._is_state_new

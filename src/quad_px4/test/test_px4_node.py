"""What the bridge to PX4 does beside its messages."""

from types import SimpleNamespace

import pytest

from quad_px4.node import Px4Interface


@pytest.mark.parametrize("taken_over", [False, True])
def test_where_px4_moves_its_estimate_the_guard_begins_anew_unless_it_flies(taken_over):
    rested = []
    guard = SimpleNamespace(taken_over=taken_over, rest=rested.append)
    bridge = SimpleNamespace(node=SimpleNamespace(guard=guard, current_step=7), _guarded_step=3)
    Px4Interface.on_shift(bridge)
    assert (rested, bridge._guarded_step) == (([], 3) if taken_over else ([7], -1))

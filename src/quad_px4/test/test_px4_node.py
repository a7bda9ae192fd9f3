"""What the bridge to PX4 does beside its messages."""

from unittest.mock import Mock

import pytest

from quad_autopilot.parameters import ArmingParameters, Flier
from quad_core.parameters import ParameterError
from quad_px4.messages import LOSS_ADVICE, PROFILE
from quad_px4.node import Px4Bridge
from quad_px4.parameters import ChosenBy


@pytest.mark.parametrize(("by_attitude", "limit"), [(False, 0.2), (True, 0.0)])
def test_offboard_instead_of_an_external_mode_has_the_limit_of_offboard(by_attitude, limit):
    bridge = Mock(_by_attitude=by_attitude, **{"flight.profile": PROFILE})
    bridge.settings = Mock(loss_limit=0.2, chosen_by=ChosenBy.BRIDGE.value, external_mode="Mine")
    bridge._offboard = lambda: Px4Bridge._offboard(bridge)
    bridge._external = Mock(failure="refused")
    Px4Bridge._register(bridge)
    assert bridge._external is None
    assert bridge.flight.profile == PROFILE._replace(loss_limit=limit, loss_advice=LOSS_ADVICE if limit else "")


@pytest.mark.parametrize(
    ("name", "chosen_by", "takeoff", "is_refused"),
    [
        ("Mine", ChosenBy.PILOT, Flier.AUTOPILOT, True),
        ("Mine", ChosenBy.PILOT, Flier.OURS, False),
        ("Mine", ChosenBy.BRIDGE, Flier.AUTOPILOT, False),
        ("", ChosenBy.PILOT, Flier.AUTOPILOT, False),
    ],
)
def test_a_take_off_after_which_a_pilot_would_have_to_choose_the_mode_again_is_refused(
    name, chosen_by, takeoff, is_refused, monkeypatch
):
    made = Mock()
    monkeypatch.setattr("quad_px4.node.ExternalMode", made)
    bridge = Mock(_by_attitude=True)
    bridge.settings = Mock(
        external_mode=name, chosen_by=chosen_by.value, arming=ArmingParameters(takeoff=takeoff.value)
    )
    if is_refused:
        with pytest.raises(
            ParameterError, match=r"arming\.takeoff: found autopilot with chosen_by pilot, expected ours"
        ):
            Px4Bridge._registered(bridge)
    else:
        Px4Bridge._registered(bridge)
    assert made.called == (bool(name) and not is_refused)


@pytest.mark.parametrize(
    ("by_attitude", "watches", "limit", "expected"),
    [
        (True, False, 0.0, ""),
        (False, False, 0.2, "expected mode attitude, or none"),
        (False, True, 0.2, ""),
        (False, True, 0.0, "expected a loss_limit above 0, mode attitude, or none"),
    ],
)
def test_without_attitude_an_external_mode_is_flown_only_where_px4_notices_a_lost_link_in_time(
    by_attitude, watches, limit, expected, monkeypatch
):
    external = Mock(watches=watches)
    monkeypatch.setattr("quad_px4.node.ExternalMode", Mock(return_value=external))
    bridge = Mock(_by_attitude=by_attitude)
    bridge.settings = Mock(external_mode="Mine", chosen_by=ChosenBy.BRIDGE.value, loss_limit=limit)
    if expected:
        with pytest.raises(ParameterError, match=expected):
            Px4Bridge._registered(bridge)
    else:
        assert Px4Bridge._registered(bridge) is external

"""Whose the vehicle is, of two messages that come at different rates."""

from types import SimpleNamespace

import pytest

from quad_autopilot.autopilot import Control
from quad_px4.autopilot import Flags, autopilot, control, mode_name

OFFBOARD, POSCTL, AUTO_LAND = 14, 2, 18


def status(nav_state, armed=True, timestamp=1000, failsafe=False):
    return SimpleNamespace(
        timestamp=timestamp,
        nav_state=nav_state,
        arming_state=2 if armed else 1,
        failsafe=failsafe,
        pre_flight_checks_pass=True,
    )


def control_mode(timestamp, armed, ours, source_id=0):
    return SimpleNamespace(
        timestamp=timestamp, flag_armed=armed, flag_control_offboard_enabled=ours, source_id=source_id
    )


@pytest.mark.parametrize(
    ("nav_state", "offboard", "later", "whose"),
    [
        (OFFBOARD, True, 500, Control.OURS),
        (OFFBOARD, False, 500, Control.UNSAID),  # taken away, the status that names the mode is still to come
        (OFFBOARD, False, -500, Control.OURS),  # an older message says nothing any more
        (POSCTL, True, -500, Control.OTHER),
        (POSCTL, False, 500, Control.OTHER),
        (POSCTL, True, 500, Control.OURS),
        (AUTO_LAND, False, 500, Control.LANDING),
        (AUTO_LAND, True, -3, Control.LANDING),
        (OFFBOARD, False, 0, Control.OURS),
    ],
)
def test_the_newer_message_says_whose_the_vehicle_is(nav_state, offboard, later, whose):
    found = autopilot(status(nav_state), control_mode(1000 + later, True, offboard), Flags())
    assert found.control == whose
    assert found.armed
    assert found.mode == {Control.OURS: "OFFBOARD", Control.UNSAID: "not said yet"}.get(whose, mode_name(nav_state))


@pytest.mark.parametrize(("source_id", "whose"), [(23, Control.OURS), (0, Control.UNSAID)])
def test_an_external_mode_is_ours_while_its_own_configuration_is_shown(source_id, whose):
    mode = control_mode(1500, True, False, source_id)
    assert autopilot(status(23), mode, Flags(), external=23).control == whose


@pytest.mark.parametrize(("later", "armed"), [(500, False), (-500, True)])
def test_the_newer_message_says_whether_it_is_armed(later, armed):
    assert autopilot(status(OFFBOARD), control_mode(1000 + later, False, True), Flags()).armed == armed
    disarmed = autopilot(status(OFFBOARD, armed=False), control_mode(1000 + later, True, True), Flags())
    assert disarmed.armed != armed


def test_the_status_says_why():
    found = autopilot(status(AUTO_LAND, failsafe=True), control_mode(2000, True, False), Flags(("battery_low",)))
    assert (found.mode, found.failsafe, found.checks_pass, found.reasons) == ("AUTO_LAND", True, True, ("battery_low",))
    assert autopilot(status(POSCTL), None, Flags()).control == Control.OTHER


@pytest.mark.parametrize(
    ("nav_state", "whose"),
    [
        *((14, Control.OURS), (18, Control.LANDING), (12, Control.LANDING), (20, Control.LANDING)),
        *((4, Control.WAITING), (17, Control.CLIMBING), (2, Control.OTHER), (5, Control.OTHER)),
    ],
)
def test_modes_by_their_numbers(nav_state, whose):
    assert control(nav_state) == whose

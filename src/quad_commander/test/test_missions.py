"""Missions: what can be written, what is refused in which words, and how one is flown."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quad_commander.missions import Item, MissionError, MissionMemory, next_request, parse
from quad_commander.mode_table import Condition, Mode, Request
from quad_commander.references import Place

NAMES = {"case1", "case2", "hover"}


def test_a_mission_is_read_in_order():
    assert parse("takeoff:2, case2,hold:5,land", NAMES) == (
        Item(Request.TAKEOFF, value=2.0),
        Item(Request.MISSION, "case2"),
        Item(Request.HOLD, value=5.0),
        Item(Request.LAND),
    )


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("goto:1 -2.5 3", Place(1.0, -2.5, 3.0)),
        ("goto:1 2 3 0", Place(1.0, 2.0, 3.0, 0.0)),
        ("goto: 1 2 3  -90deg", Place(1.0, 2.0, 3.0, -math.pi / 2.0)),
    ],
)
def test_a_place_has_three_coordinates_and_may_have_a_heading(text, place):
    (_, item, _) = parse(f"takeoff,{text}", NAMES)
    assert item == Item(Request.GOTO, place=place)
    assert parse(f"takeoff,goto:{item.place}", NAMES)[1].place == pytest.approx(place)


def test_every_mission_ends_with_a_landing():
    assert parse("takeoff", NAMES) == (Item(Request.TAKEOFF, value=1.5), Item(Request.LAND))


@pytest.mark.parametrize(("text", "found", "expected"), [
    ("", "''", "takeoff[:height], hold:seconds, goto:x y z [yaw], land, case1, case2, hover"),
    ("takeoff,case3", "'case3' as item 2", "case1, case2, hover"),
    ("takeoff,,land", "'' as item 2", "takeoff[:height]"),
    ("case2,land", "item 1 'case2'", "takeoff first"),
    ("takeoff,takeoff,land", "item 2 'takeoff'", "takeoff only as the first item"),
    ("takeoff,land,case2", "'case2' after land", "land as the last item"),
    ("takeoff,hold", "'hold' as item 2", "hold:seconds"),
    ("takeoff,hold:x", "'hold:x'", "a time in s above 0"),
    ("takeoff,hold:nan", "'hold:nan'", "a time in s above 0"),
    ("takeoff,hold:-1", "'hold:-1'", "a time in s above 0"),
    ("takeoff:1e9", "'takeoff:1e9'", "a height in m above 0 and at most 1000"),
    ("takeoff:", "'takeoff:'", "a height in m"),
    ("takeoff,case2:3", "'case2:3' as item 2", "case2"),
    ("takeoff,goto", "'goto' as item 2", "goto:x y z [yaw]"),
    ("takeoff,goto:1 2", "'goto:1 2'", "x y z in m and, if it changes, yaw in rad (or 90deg)"),
    ("takeoff,goto:1 2 3 4 5", "'goto:1 2 3 4 5'", "x y z in m"),
    ("takeoff,goto:1 two 3", "'goto:1 two 3'", "x y z in m"),
    ("takeoff,goto:1 2 nan", "'goto:1 2 nan'", "[-10000, 10000] m"),
    ("takeoff,goto:1 2 3 90", "'goto:1 2 3 90'", "for degrees write 90deg"),
    ("takeoff," + "hold:1," * 100 + "land", "102 items", "at most 100"),
])  # fmt: skip
def test_what_cannot_be_flown_is_named(text, found, expected):
    with pytest.raises(MissionError) as error:
        parse(text, NAMES)
    assert f"found {found}" in str(error.value)
    assert expected in str(error.value)


@given(st.text(alphabet="takeofldcs2hg:,15. ", max_size=40))
def test_no_text_raises_anything_else(text):
    try:
        items = parse(text, NAMES)
    except MissionError:
        return
    assert items[0].request == Request.TAKEOFF
    assert items[-1].request == Request.LAND


def flown(steps, text="takeoff,case2,hold:5,land"):
    """Return what is asked for over (mode, reason, seconds) at 10 Hz: the requests without repetitions."""
    mission, memory, requests = parse(text, NAMES), MissionMemory(), []
    for mode, reason, seconds in steps:
        for _ in range(round(10 * seconds)):
            request, memory = next_request(mission, memory, mode, reason, 0.1)
            if request != (requests[-1] if requests else Request.NONE):
                requests.append(request)
    return [request.name for request in requests if request != Request.NONE], memory


ON_REQUEST = -2
GOOD_FLIGHT = [
    (Mode.DISARMED, -1, 0.5),
    (Mode.ARMING, ON_REQUEST, 1.0),
    (Mode.TAKEOFF, Condition.READY, 3.0),
    (Mode.HOLD, Condition.AT_HEIGHT, 0.2),
    (Mode.MISSION, ON_REQUEST, 10.0),
    (Mode.HOLD, Condition.PLAN_ENDED, 5.2),
    (Mode.LAND, ON_REQUEST, 3.0),
    (Mode.DISARMED, Condition.CONTACT, 2.0),
]


def test_a_mission_asks_for_one_item_after_the_other_and_for_nothing_after_the_last():
    requests, memory = flown(GOOD_FLIGHT)
    assert requests == ["TAKEOFF", "MISSION", "LAND"]
    assert memory.item == 3


def test_a_hold_lasts_its_time():
    assert flown([*GOOD_FLIGHT[:5], (Mode.HOLD, Condition.PLAN_ENDED, 4.8)])[0] == ["TAKEOFF", "MISSION"]
    assert (
        flown([*GOOD_FLIGHT[:5], (Mode.HOLD, Condition.PLAN_ENDED, 9.8)], "takeoff,case2,hold:5,hold:5")[0][-1]
        != "LAND"
    )


def test_a_mission_waits_when_something_else_took_its_mode():
    for reason in (Condition.REFERENCE_LATE, ON_REQUEST, Condition.ESTIMATOR_RESET):
        on_hold = [*GOOD_FLIGHT[:5], (Mode.HOLD, reason, 60.0)]
        assert flown(on_hold)[0] == ["TAKEOFF", "MISSION"]
        # an operator asks for MISSION again, and it goes on
        resumed = [*on_hold, *GOOD_FLIGHT[4:]]
        assert flown(resumed)[0] == ["TAKEOFF", "MISSION", "LAND"]


@pytest.mark.parametrize("mode", [Mode.LAND, Mode.DESCEND, Mode.PILOT, Mode.KILL])
def test_nothing_is_asked_for_once_the_vehicle_comes_down(mode):
    down = [*GOOD_FLIGHT[:5], (mode, Condition.BATTERY_LOW, 30.0), (Mode.DISARMED, Condition.CONTACT, 60.0)]
    assert flown(down)[0] == ["TAKEOFF", "MISSION"]

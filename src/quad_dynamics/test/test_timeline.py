"""Scenario events: what each one does and when, what is refused, and that all is drawn once for a seed."""

import math
import re

import numpy as np
import pytest
from plant_cases import ASYMMETRIC

from quad_core.parameters import ParameterError
from quad_core.types import CALM, Rotors, SensorFault, Vec3
from quad_dynamics import held_gaussian, timeline
from quad_dynamics.timeline import Parameters

ALL = """
wind start=1 velocity=3,-2,0.5
gust start=2 end=4 velocity=0,6,0
dryden wind=5 altitude=10 airspeed=5 direction=0.5
held_gaussian start=1 end=9
push start=3 end=3.5 force=1,2,3 torque=0.1,0.2,0.3     # a pulse
payload start=4 end=8 mass=0.2
rotor start=5 number=3 effectiveness=0.7
rotor start=6 number=3 effectiveness=0.5
battery start=2 limit=0.6 sag=4
freeze start=7 end=7.2
jump start=7.1 end=8 offset=0.5,0,0 yaw=0.3
link start=6 delay=0.004 jitter=0.006 drop=0.1
"""


def at(text, time, seed=1, duration=20.0):
    parameters = Parameters(text)
    return timeline.sample(parameters, timeline.draw(parameters, ASYMMETRIC, seed, duration), time)


def test_nothing_is_calm():
    assert at("", 3.0) == CALM
    assert at("# only a comment\n\n", 3.0) == CALM


def test_events_act_from_start_up_to_their_end_at_steps_of_the_plant():
    text = "push start=0.3 end=0.6 force=1,0,0"
    acting = [k for k in range(500) if at(text, k * 2_000_000 / 1e9).force_w.x == 1.0]
    assert acting == list(range(150, 300))


def test_winds_add_and_a_gust_is_a_raised_cosine():
    text = "wind velocity=3,-2,0.5\ngust start=2 end=4 velocity=0,6,0"
    assert at(text, 1.0).wind_w == (3.0, -2.0, 0.5)
    for since in (0.0, 0.3, 1.0, 1.7):
        expected = -2.0 + 6.0 * 0.5 * (1.0 - math.cos(math.pi * since))
        assert at(text, 2.0 + since).wind_w == pytest.approx((3.0, expected, 0.5), abs=1e-6)
    assert at(text, 4.0).wind_w == (3.0, -2.0, 0.5)


def test_pushes_and_payloads_add():
    text = "push force=1,2,3\npush start=1 force=1,1,1 torque=0.1,0.2,0.3"
    assert at(text, 2.0).force_w == (2.0, 3.0, 4.0)
    assert at(text, 2.0).torque_b == (0.1, 0.2, 0.3)
    assert at(text, 0.5).torque_b == (0.0, 0.0, 0.0)
    loads = "payload mass=0.25\npayload start=1 end=2 mass=0.5"
    assert [at(loads, time).payload_mass for time in (0.5, 1.5, 2.0)] == [0.25, 0.75, 0.25]


def test_rotor_losses_multiply_and_a_battery_sags_evenly():
    text = "rotor start=1 number=3 effectiveness=0.8\nrotor start=2 number=3 effectiveness=0.5"
    text += "\nrotor number=1 effectiveness=0"
    assert at(text, 0.5).rotor_effectiveness == Rotors(0.0, 1.0, 1.0, 1.0)
    assert at(text, 3.0).rotor_effectiveness == Rotors(0.0, 1.0, 0.4, 1.0)
    sag = "battery start=2 limit=0.6 sag=4"
    assert [at(sag, t).thrust_limit for t in (1.0, 2.0, 3.0, 4.0, 6.0, 9.0)] == pytest.approx(
        [1, 1, 0.9, 0.8, 0.6, 0.6]
    )


def test_sensor_and_link_faults():
    text = "freeze start=1 end=2\njump start=1.5 end=3 offset=0.5,0,-1 yaw=0.3"
    assert not at(text, 0.5).sensor.frozen
    assert at(text, 1.2).sensor == SensorFault(frozen=True)
    assert at(text, 1.7).sensor == SensorFault(frozen=True, offset_w=Vec3(0.5, 0.0, -1.0), yaw_offset=0.3)
    assert at(text, 2.5).sensor == SensorFault(offset_w=Vec3(0.5, 0.0, -1.0), yaw_offset=0.3)
    parameters = Parameters("link start=1 delay=0.01 jitter=0.02 drop=0.25")
    table = timeline.draw(parameters, ASYMMETRIC, 3, 25.0)
    faults = [timeline.sample(parameters, table, 1.0 + 0.002 * k).link for k in range(10_000)]
    delays = np.array([fault.delay for fault in faults])
    assert (delays.min(), delays.max()) == (pytest.approx(0.01, abs=1e-4), pytest.approx(0.03, abs=1e-4))
    assert delays.std() == pytest.approx(0.02 / math.sqrt(12), rel=0.03)
    assert np.mean([fault.lost for fault in faults]) == pytest.approx(0.25, abs=4.0 * math.sqrt(0.1875 / 10_000))


def test_whether_a_command_is_lost_does_not_depend_on_its_delay():
    parameters = Parameters("link delay=0.01 jitter=0.02 drop=0.25")
    table = timeline.draw(parameters, ASYMMETRIC, 3, 20.0)
    faults = [timeline.sample(parameters, table, 0.002 * k).link for k in range(10_000)]
    related = np.corrcoef([fault.delay for fault in faults], [fault.lost for fault in faults])[0, 1]
    assert abs(related) < 4.5 / math.sqrt(10_000)


def test_an_event_begins_and_ends_at_the_step_that_rounding_puts_just_before():
    assert at("push start=0 end=0.3 force=1,0,0", math.nextafter(0.3, 0.0)).force_w.x == 0.0
    assert at("push start=0.3 end=0.6 force=1,0,0", math.nextafter(0.3, 0.0)).force_w.x == 1.0


def test_turbulence_goes_straight_from_sample_to_sample():
    air = [at("dryden wind=8 airspeed=6", 0.5 + t).wind_w for t in (0.0, 0.0025, 0.005, 0.01)]
    for share, found in ((0.25, air[1]), (0.5, air[2])):
        straight = np.array(air[0]) + share * np.subtract(air[3], air[0])
        np.testing.assert_allclose(found, straight, atol=1e-6)
    assert np.abs(np.subtract(air[3], air[0])).min() > 1e-4


def test_turbulence_turns_with_the_direction_of_the_wind():
    east, north = (at(f"dryden wind=8 airspeed=6 direction={turn}", 3.0).wind_w for turn in (0.0, math.pi / 2))
    assert north == pytest.approx((-east.y, east.x, east.z), abs=1e-12)


def test_each_value_of_the_paper_s_disturbance_holds_for_its_time():
    text = "held_gaussian end=1.9 hold=0.5"
    assert len({at(text, time).force_w for time in (0.1, 0.4, 0.6, 0.9, 1.1, 1.4, 1.6, 1.85)}) == 4


def test_the_paper_s_disturbance_is_the_same_kind_as_on_its_own():
    parameters = Parameters("held_gaussian start=2 hold=0.5 acceleration_sd=0.4")
    table = timeline.draw(parameters, ASYMMETRIC, 5, 4000.0)
    pushes = np.array([timeline.sample(parameters, table, 2.0 + 0.5 * i).force_w for i in range(7990)])
    assert pushes.std(axis=0) / ASYMMETRIC.mass == pytest.approx([0.4] * 3, rel=0.04)
    again = [timeline.sample(parameters, table, 2.0 + 0.5 * i + 0.49).force_w for i in range(50)]
    assert np.array_equal(again, pushes[:50])
    assert held_gaussian.Parameters()[0] == 0.5


def test_a_longer_flight_begins_like_a_shorter_one_and_seeds_differ():
    times = np.arange(0.0, 9.9, 0.173).tolist()
    short = [at(ALL, time, 4, 10.0) for time in times]
    assert short == [at(ALL, time, 4, 60.0) for time in times]
    assert short != [at(ALL, time, 5, 10.0) for time in times]


@pytest.mark.parametrize(("line", "problem"), [
    ("typhoon start=1", "unknown kind 'typhoon'; expected one of wind, gust"),
    ("wind start=1", "velocity= is missing"),
    ("wind velocity=1,2", "expected x,y,z in m/s"),
    ("wind velocity=1,2,fast", "velocity: found 'fast'"),
    ("wind velocity=1,2,nan", "velocity: found 'nan'"),
    ("wind velocity=1,2,3 speed=4", "found 'speed=4', expected some of start=, end=, velocity="),
    ("wind velocity=1,2,3 velocity=1,2,3", "velocity stands twice"),
    ("gust start=1 velocity=1,0,0", "a gust needs end="),
    ("push start=5 end=4 force=1,0,0", "end: found 4, expected more than start, 5"),
    ("push start=-1 force=1,0,0", r"start: found '-1', expected a number in \[0, 7200\] s"),
    ("push start=9999 force=1,0,0", "start: found '9999'"),
    ("rotor number=5 effectiveness=0", "number: found '5'"),
    ("rotor number=1.5 effectiveness=0", "expected 1, 2, 3 or 4"),
    ("battery limit=0", "limit: found '0'"),
])  # fmt: skip
def test_what_is_refused_names_line_found_and_expected(line, problem):
    with pytest.raises(ParameterError, match=f"events: {re.escape(repr(line))}: .*{problem}"):
        timeline.check(Parameters(f"# a scenario\n{line}\n"))


def test_announcements_are_in_order_of_time():
    announced = timeline.announcements(
        Parameters("gust start=2 end=4 velocity=1,0,0\nfreeze start=1 end=3\nwind velocity=1,0,0")
    )
    assert [(time, kind, text.partition(":")[0]) for time, kind, text in announced] == [
        (0.0, "wind", "begins"),
        (1.0, "freeze", "begins"),
        (2.0, "gust", "begins"),
        (3.0, "freeze", "ends"),
        (4.0, "gust", "ends"),
    ]

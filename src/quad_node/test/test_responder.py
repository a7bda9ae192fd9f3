"""Which states a node answers: those whose inputs are there, once, and no foreign message changes that."""

import math
import time
import zlib
from functools import partial
from types import SimpleNamespace

import pytest
from rclpy.serialization import serialize_message

from quad_core.types import TrajectoryPoint
from quad_msgs import msg
from quad_node.codec import set_stamp
from quad_node.flight_node import FlightNode
from quad_node.responder import LARGEST_GAP, QUIET, Responder, SequenceFilter, saw_start

FLYING = msg.FlightState.FLYING
PERIOD = 2_000_000  # ns


class Echo:
    """Notes each sample; its answer is the number of samples so far."""

    def __init__(self, callbacks):
        self.callbacks, self.node = callbacks, FlightNode("position_controller")
        self.responder, self.counts = Responder(self.node, self.step), self.node.events.counts
        self.sent, self.samples = [], []
        self.responder.take("reference")
        self.responder.take("actuation", lag=1)

    def step(self, sample, arrivals):
        self.samples.append((sample, [arrival.value if arrival else None for arrival in arrivals]))
        return [(SimpleNamespace(publish=self.sent.append), len(self.samples))]

    def state(self, step, x=0.0, stamp=None, run=0):
        message = msg.VehicleState(step=step, run=run)
        message.p_w[0], message.q_wb[3] = x, 1.0
        set_stamp(message.stamp, step * PERIOD if stamp is None else stamp)
        self.callbacks["state"](serialize_message(message))

    def reference(self, step, next_step, x=0.0, run=0):
        message = msg.TrajectoryPoint(step=step, next_step=next_step, run=run)
        message.p_w[0] = x
        self.callbacks["reference"](serialize_message(message))

    def actuation(self, step, thrust=0.0):
        self.callbacks["actuation"](serialize_message(msg.Actuation(step=step, thrust=thrust)))

    def steps(self):
        return [sample.step for sample, _ in self.samples]


@pytest.fixture
def make(start_node, callbacks):
    """Return a function that makes the node with the given ROS parameters."""
    return partial(start_node, lambda: Echo(callbacks))


def test_a_step_waits_for_its_reference_and_the_actuation_before_it(make):
    node = make("period_steps:=1")
    node.state(0)
    assert node.steps() == []
    node.reference(0, 1)
    assert node.steps() == [0]
    assert node.samples[0][1][1] is None  # before the first step there is no actuation
    node.state(1)
    node.reference(1, 2)
    assert node.steps() == [0]
    node.actuation(0, thrust=7.0)
    assert node.steps() == [0, 1]
    _, (reference, actuation) = node.samples[1]
    assert isinstance(reference, TrajectoryPoint)
    assert actuation.thrust == 7.0


def test_a_reference_holds_from_its_step_until_the_next(make):
    node = make("period_steps:=1")
    node.reference(0, 3, x=10.0)
    for step in range(2):
        node.actuation(step)
        node.state(step)
    node.reference(3, 6, x=20.0)  # early
    node.actuation(2)
    node.state(2)
    node.state(3)
    assert node.steps() == [0, 1, 2, 3]
    assert [reference.p_w.x for _, (reference, _) in node.samples] == [10.0, 10.0, 10.0, 20.0]


def test_only_multiples_of_the_period_are_answered(make):
    node = make("period_steps:=5")
    node.reference(0, 100)
    for step in range(12):
        node.actuation(step)
        node.state(step)
    assert node.steps() == [0, 5, 10]
    assert {sample.dt for sample, _ in node.samples} == {0.01}
    assert [sample.stamp_ns for sample, _ in node.samples] == [0, 10_000_000, 20_000_000]


def test_a_state_that_comes_twice_is_answered_once(make):
    node = make("period_steps:=1")
    node.reference(0, 1)
    for _ in range(3):
        node.state(0)
    assert node.steps() == [0]
    assert node.sent == [1]


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e13, -1e300])
def test_an_input_that_is_not_finite_or_absurd_is_counted_and_not_used(make, bad, mode):
    node = make("period_steps:=1", f"flight.mode:={mode}")
    node.state(0)
    node.reference(0, 1, x=bad)
    assert (node.steps(), node.counts["rejected"]) == ([], 1)
    node.reference(0, 1, x=3.0)
    assert [values[0].p_w.x for _, values in node.samples] == [3.0]


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1.1e4])
def test_a_state_that_cannot_be_flown_is_counted_and_not_answered(make, bad):
    node = make("period_steps:=1")
    node.reference(0, 10)
    node.state(0)
    node.state(1, x=bad)
    assert node.steps() == [0]
    assert node.counts["rejected"] == 1
    node.state(2)
    node.actuation(1)
    assert node.steps() == [0, 2]


def test_in_real_time_the_newest_input_counts_and_nobody_waits_for_actuation(make):
    node = make("period_steps:=1", "flight.mode:='realtime'")
    node.state(0)
    assert node.steps() == []
    node.reference(0, 1, x=1.0)
    node.state(7)
    node.reference(1, 2, x=2.0)
    node.actuation(2, thrust=7.0)
    node.state(8)
    node.state(9)
    assert node.steps() == [0, 7, 8]
    assert [values[0].p_w.x for _, values in node.samples] == [1.0, 2.0, 2.0]
    assert [values[1].thrust if values[1] else None for _, values in node.samples] == [None, 7.0, 7.0]


@pytest.mark.parametrize(("gap", "dt", "odd"), [
    (PERIOD, 0.002, 0),
    (3 * PERIOD // 2, 0.003, 0),
    (PERIOD // 4, 0.0005, 1),
    (50 * PERIOD, 0.1, 1),
    (0, 0.002, 1),  # the law divides by it
    (-PERIOD, 0.002, 1),
])  # fmt: skip
def test_in_real_time_the_law_gets_the_time_that_passed_and_odd_ones_are_counted(make, gap, dt, odd):
    node = make("period_steps:=1", "flight.mode:='realtime'")
    node.reference(0, 100)
    node.state(0, stamp=PERIOD)
    node.state(1, stamp=PERIOD + gap)
    assert [sample.dt for sample, _ in node.samples] == [0.002, dt]
    assert node.counts["dt_odd"] == odd


def begun(node, wall_time, state=FLYING):
    """Let flight/state say that the flight is ``wall_time`` s old."""
    node.callbacks["flight/state"](msg.FlightState(state=state, wall_time=wall_time))


def test_in_lockstep_a_node_that_comes_into_a_flight_is_silent(make):
    node = make()
    node.reference(0, 100)
    node.actuation(9)
    for step in (7, 7, 8, 9, 10):
        node.state(step)
    assert node.steps() == []
    assert node.counts["came_late"] == 1


def test_a_shadow_takes_part_in_a_flight_under_way_from_a_multiple_of_its_period_on(make):
    node = make(name="shadow_position_controller")
    node.reference(0, 100)
    for step in range(7, 17):
        node.actuation(step - 1)
        node.state(step)
    assert node.steps() == [10, 15]


@pytest.mark.parametrize(("wall_time", "steps"), [(0.0, [52, 53]), (8.0, [])])
def test_in_real_time_nothing_is_answered_before_it_is_known_how_old_the_flight_is(make, wall_time, steps):
    node = make("period_steps:=1", "flight.mode:=realtime")
    node.reference(0, 100)
    node.state(50)
    begun(node, 0.0, msg.FlightState.WAITING)
    node.state(51)
    node.node.ready_at = time.monotonic()
    begun(node, wall_time)
    for step in (52, 53):
        node.state(step)
    assert node.steps() == steps


def test_after_one_absurd_step_that_is_rejected_the_next_one_is_answered(make):
    node = make("period_steps:=1", "flight.mode:=realtime")
    node.reference(0, 10)
    node.state(0)
    node.state(2**62, stamp=PERIOD)
    assert node.counts["rejected"] == 1
    node.state(1)
    assert node.steps() == [0, 1]


@pytest.mark.parametrize("payload", [b"", b"\x00\x01\x00\x00", b"\x00\x00\x00\x00" + bytes(200), bytes(3)])
@pytest.mark.parametrize("topic", ["state", "reference", "actuation"])
def test_a_malformed_message_is_refused_and_does_not_end_the_node(make, topic, payload):
    node = make("period_steps:=1")
    before = node.responder.state_heard
    node.callbacks[topic](payload)
    assert (node.node.flying, node.responder.state_heard, node.responder.states_seen) == (False, before, 0)
    node.reference(0, 1)
    node.state(0)
    assert node.steps() == [0]


OURS, THEIRS = zlib.crc32(b"ours"), zlib.crc32(b"theirs")


@pytest.mark.parametrize("clock", ["lockstep", "realtime"])
@pytest.mark.parametrize("run", [THEIRS, 0])
def test_states_and_inputs_of_another_run_or_of_none_are_as_if_they_had_not_come(make, clock, run):
    node = make("period_steps:=1", "flight.run_id:=ours", f"flight.mode:={clock}")
    before = node.responder.state_heard
    node.state(7, run=run)
    node.reference(0, 1, x=10.0, run=run)
    assert (node.node.flying, node.responder.state_heard, node.steps()) == (False, before, [])
    assert node.counts["foreign_run"] == 2
    node.reference(0, 1, x=20.0, run=OURS)
    node.state(0, run=OURS)
    node.reference(0, 1, x=30.0, run=run)
    assert node.steps() == [0]
    assert node.samples[0][1][0].p_w.x == 20.0


@pytest.mark.parametrize("mode", ["realtime", "lockstep"])
def test_a_state_that_a_stranger_sent_does_not_make_the_later_ones_old(make, mode):
    node = make("period_steps:=5", f"flight.mode:={mode}")
    node.reference(0, 2**64 - 1)
    node.actuation(4)
    node.state(0)
    node.state(200)
    for step in range(4, 26):
        node.state(step)
    assert 5 <= node.steps()[-1] <= 25


@pytest.mark.parametrize("mode", ["realtime", "lockstep"])
def test_a_state_with_the_stamp_of_another_time_is_refused(make, mode):
    node = make("period_steps:=1", f"flight.mode:={mode}")
    node.reference(0, 1)
    node.state(0, stamp=(2**31 - 1) * 10**9)  # a trajectory could not say when its plan ends
    assert (node.counts["rejected"], node.counts["rejected_stamp"]) == (1, 1)
    node.state(0)
    assert [(sample.step, sample.stamp_ns) for sample, _ in node.samples] == [(0, 0)]


def test_in_real_time_a_step_waits_for_its_own_reference_as_in_lockstep(make):
    """The publisher answers the same state a moment later: without the wait the law flies a period behind."""
    node = make("period_steps:=5", "flight.mode:=realtime")
    node.reference(0, 5, x=10.0)
    node.state(0)
    node.state(5)
    assert node.steps() == [0]
    node.reference(5, 10, x=20.0)
    assert node.steps() == [0, 5]
    assert node.samples[1][1][0].p_w.x == 20.0


def test_in_real_time_a_step_waits_no_longer_than_until_the_next_state(make):
    node = make("period_steps:=5", "flight.mode:=realtime")
    node.reference(0, 5, x=10.0)
    node.state(0)
    node.state(5, x=0.5)
    node.state(6, x=0.6)
    assert node.steps() == [0, 5]
    assert (node.samples[1][0].state.p_w.x, node.samples[1][1][0].p_w.x) == (0.5, 10.0)
    node.reference(5, 10, x=20.0)
    assert node.steps() == [0, 5]
    node.state(11)  # its own due state left out, and so is 10's reference
    assert node.steps() == [0, 5]
    node.state(16)
    assert node.steps() == [0, 5, 11]


def test_in_real_time_an_input_that_is_slower_than_the_node_does_not_delay_it(make):
    node = make("period_steps:=1", "flight.mode:=realtime")
    node.reference(0, 5)
    for step in range(8):
        node.state(step)
    assert node.steps() == list(range(8))


def test_foreign_inputs_of_the_same_run_displace_none_that_a_step_in_lockstep_needs(make):
    node = make("period_steps:=1")
    node.reference(0, 1, x=1.0)
    for step in range(251):
        node.reference(step, 2**64 - 1, x=9.0)
    node.reference(251, 2**64 - 1, x=9.0)
    node.state(0)
    assert node.samples[0][1][0].p_w.x == 1.0
    node.reference(10**6, 2**64 - 1, x=9.0)
    assert node.counts["rejected_future"] == 1


@pytest.mark.parametrize(("mode", "x"), [("lockstep", 1.0), ("realtime", 2.0)])
def test_of_two_values_for_a_step_the_first_counts_in_lockstep_and_the_last_in_real_time(make, mode, x):
    node = make("period_steps:=1", f"flight.mode:={mode}")
    node.reference(0, 1, x=1.0)
    node.reference(0, 1, x=2.0)
    node.state(0)
    assert node.samples[0][1][0].p_w.x == x


STEP = PERIOD * 1e-9  # s
FAR = 2**63


class Flight:
    """States in their order."""

    def __init__(self, lockstep=False):
        self.order, self.accepted = SequenceFilter(PERIOD, lockstep), []

    def say(self, *steps):
        for step in steps:
            if self.order.allows(step):
                self.order.take(step)
                self.accepted.append(step)
        return self


def test_states_follow_each_other_and_may_come_again():
    assert Flight().say(0, 1, 1, 2, 7).accepted == [0, 1, 1, 2, 7]


@pytest.mark.parametrize("count", [1, 50])
@pytest.mark.parametrize("far", [FAR, 100_000, 2])
def test_states_of_another_run_among_the_flights_are_rejected(count, far):
    flight = Flight().say(*range(1000, 1010))
    for step in range(1010, 1100):
        flight.say(*[far] * count).say(step)
    assert flight.accepted == [*range(1000, 1100)]


def test_after_a_real_gap_states_are_accepted_that_go_on():
    flight = Flight().say(0, 1, *range(1000, 1030))
    assert flight.accepted == [0, 1, *range(1000 + round(QUIET / STEP) + 1, 1030)]


@pytest.mark.parametrize("lockstep", [False, True])
def test_our_own_states_repeated_later_are_never_taken_however_slowly_the_flight_goes_on(lockstep):
    flight = Flight(lockstep)
    for step in range(1000, 1400, 10):  # ten copies of old states between two of ours
        flight.say(step, *range(step - 300, step - 290))
    assert flight.accepted == [*range(1000, 1400, 10)]
    flight.say(*range(1000, 1300))  # while the plant waits
    assert (flight.accepted[-1] == 1390) == lockstep


def test_in_lockstep_a_foreign_state_that_was_accepted_costs_none_of_ours():
    assert Flight(lockstep=True).say(0, 1, 200, 2, 3).accepted == [0, 1, 200, 2, 3]


@pytest.mark.parametrize("far", [FAR, 200])  # one that may follow, too: 0.4 s ahead
def test_after_a_foreign_state_was_accepted_ours_are_again_before_the_guard_takes_over(far):
    flight = Flight().say(far).say(*range(100))
    first = flight.accepted[1]
    assert first * STEP < QUIET + 3 * STEP < 0.05
    assert flight.accepted == [far, *range(first, 100)]


def test_what_is_far_ahead_is_told_from_what_is_old():
    order = SequenceFilter(PERIOD)
    order.take(1000)
    largest = round(LARGEST_GAP / STEP)
    assert [order.is_far_ahead(step) for step in (0, 999, 1000 + largest, 1001 + largest)] == [False] * 3 + [True]


NOT, NEVER = math.inf, math.inf


@pytest.mark.parametrize(("lockstep", "step", "ready", "began", "saw"), [
    (True, 0, NEVER, None, True),
    (False, 0, NEVER, None, True),
    (True, 5, 1.0, 2.0, False),
    (False, 5, 1.0, 2.0, True),
    (False, 5, 1.0, NOT, True),  # an estimator speaks before the flight
    (False, 5, 1.0, -6.0, False),
    (False, 5, NEVER, 0.9, False),  # its own flight waits until it is ready
    (False, 5, NEVER, NOT, None),
    (False, 5, 1.0, None, None),
])  # fmt: skip
def test_in_real_time_a_flight_that_is_older_than_the_node_is_ready_is_another_s(lockstep, step, ready, began, saw):
    assert saw_start(lockstep, step, ready, began) is saw

"""Which attitude setpoints go to an autopilot that is flown by attitude."""

import math
from unittest.mock import Mock

import pytest
from sequence_flights import PROFILE

from quad_autopilot import odometry
from quad_autopilot.autopilot import Autopilot, Control, Stamps
from quad_autopilot.autopilot_flight import BEAT, AutopilotFlight
from quad_autopilot.evidence import Intent, Memory, Phase
from quad_autopilot.parameters import ArmingParameters
from quad_core.lift_off import standing
from quad_core.node_parameters import GuardParameters, StepLimits
from quad_core.types import AttitudeThrust, Quat, Vec3, VehicleState, Wrench
from quad_guard.checks import StateSample, WrenchCommand
from quad_msgs.msg import FlightState
from quad_node.codec import Stamped

PERIOD, NOW = 4_000_000, 1000
LEVEL = AttitudeThrust(thrust=8.0)


def sent(value, step=NOW, finite=True):
    """Return the setpoint for the state of ``step`` if it is flown, and why it is refused."""
    flight = Mock(**{"leader.guard.parameters": GuardParameters()})
    flight.node = Mock(current_step=NOW, **{"flight.plant_period": PERIOD})
    flight._unpack_setpoint.return_value = Stamped(step, step + 1, step * PERIOD, value, finite)
    flight._setpoint_refusal = lambda stamped: AutopilotFlight._setpoint_refusal(flight, stamped)
    flight.within_thrust_range = lambda newtons: min(newtons, 9.0)
    flown, reject = AutopilotFlight.accepted(flight, b""), flight.node.events.reject
    assert flight.note_command.called == (flown is not None) != reject.called
    return flown, str(reject.call_args)


@pytest.mark.parametrize("step", [NOW, NOW - 2, NOW - 25])
def test_an_answer_to_a_state_of_the_last_100_ms_is_flown(step):
    assert sent(LEVEL, step)[0] == LEVEL
    assert sent(LEVEL._replace(thrust=20.0), step)[0] == LEVEL._replace(thrust=9.0)


def test_the_first_limit_that_is_broken_ends_the_stream_and_is_named():
    flight = Mock(limits=StepLimits(speed=0.5, box=1.0), broken_limit="", _home=Vec3(5.0, 0.0, 0.0))
    for x, v, said in ((5.9, 0.4, ""), (6.1, 0.4, "out of the box of the step"), (6.2, 0.9, "out of the box")):
        state = VehicleState(p_w=Vec3(x, 0.0, 0.5), v_w=Vec3(v, 0.0, 0.0))
        AutopilotFlight._watch_limits(flight, state)
        assert flight.broken_limit.startswith(said)
    assert "(found 1.10 0.00 0.50 m from the take-off, 0.40 m/s, 0.0 deg)" in flight.broken_limit
    assert not AutopilotFlight.may_fly(flight)


@pytest.mark.parametrize(("step", "age"), [(NOW - 26, "0.104 s"), (0, "4 s"), (NOW + 1, "-0.004 s")])
def test_an_answer_to_an_older_state_or_to_none_yet_is_no_command(step, age):
    flown, why = sent(LEVEL, step)
    assert flown is None
    assert f"answers a state {age} old, expected 0 to 0.1 s" in why


@pytest.mark.parametrize(("value", "finite", "word"), [
    (LEVEL._replace(q_wb=Quat(0.0, 0.0, 0.0, 0.0)), True, "length 1"),
    (LEVEL._replace(q_wb=Quat(0.0, 0.0, 0.0, 1e200)), True, "length 1"),
    (LEVEL._replace(angles=Vec3(math.nan, 0.0, 0.0)), False, "not finite"),
])  # fmt: skip
def test_what_is_no_attitude_is_no_command(value, finite, word):
    flown, why = sent(value, finite=finite)
    assert flown is None
    assert word in why


@pytest.mark.parametrize(("phase", "goes_on"), [(FlightState.WAITING, False), (FlightState.FLYING, True)])
def test_a_node_that_fails_holds_up_the_sequence_before_the_flight_alone(phase, goes_on):
    flight = Mock(is_over=False, clock=lambda: 1.0, _beat_at=1.0 - BEAT)
    flight.leader.phase, flight.leader.stood_still = phase, ""
    flight.settings.arming = ArmingParameters()
    flight.leader.handshake.missing.return_value = ["recorder (was killed by SIGKILL)"]
    assert AutopilotFlight.begin_step(flight) == goes_on


@pytest.mark.parametrize(("paused", "flies"), [(0.0, True), (0.05, True), (0.2, False)])
def test_a_command_that_waited_while_this_process_stood_still_is_not_flown(paused, flies):
    flight = Mock(broken_limit="", phase=Phase.FLY, clock=lambda: 20.0 + BEAT + paused, _beat_at=20.0)
    flight.settings.arming, flight._intent.return_value = ArmingParameters(), Intent.FLY
    assert bool(AutopilotFlight.may_fly(flight)) == flies


@pytest.mark.parametrize(("since", "cause"), [(0.1, "px4_bridge stood still for 9.54 s"), (5.0, "")])
def test_a_flight_that_fails_right_after_this_process_stood_still_has_failed_by_that(since, cause):
    flight = Mock(
        clock=lambda: 20.0, phase=Phase.FLY, sequence=Memory(Phase.FLY, since=10.0), stop="", broken_limit="", ack=None
    )
    flight.profile, flight.said = PROFILE, Autopilot("AUTO_LAND", Control.LANDING, armed=False)
    flight.settings.arming, flight.stamps.return_value, flight._intent.return_value = (
        ArmingParameters(),
        Stamps(),
        Intent.FLY,
    )
    flight.heard = flight.spoke_at = flight._unanswered_at = 20.0
    flight._pause, flight._paused_at = "px4_bridge stood still for 9.54 s", 20.0 - since
    flight.leader.cause, flight.leader.gives_up = "", False
    assert "disarmed in flight" in AutopilotFlight.step(flight).reason
    assert flight.leader.cause == cause


@pytest.mark.parametrize("taken_over", [False, True])
def test_where_the_autopilot_moves_its_estimate_the_guard_begins_anew_unless_it_flies(taken_over):
    flight = Mock(_guarded_step=3, _is_state_new=False, **{"leader.guard.taken_over": taken_over})
    AutopilotFlight._show_guard(flight, is_published=True, is_shifted=True)
    assert flight._rest_guard.called != taken_over
    assert flight._is_state_new


@pytest.mark.parametrize(("given", "is_new"), [(True, True), (False, False)])
def test_by_attitude_the_guard_judges_each_state_under_the_thrust_that_is_known(given, is_new):
    flight = Mock(by_attitude=True, phase=Phase.FLY, origin=0, _guarded_step=NOW - 1, _thrust=8.0, _is_state_new=given)
    flight.node = Mock(current_step=NOW, **{"flight.plant_period": PERIOD})
    flight.clock, flight.heard, flight.state = (lambda: 1.0), 1.0 - 1.5e-9 * PERIOD, VehicleState(p_w=Vec3(z=2.0))
    flight._given = lambda: AutopilotFlight._given(flight)
    AutopilotFlight.step_guard(flight)
    commands, samples, steps = zip(*(call.args for call in flight.leader.guarded.call_args_list), strict=True)
    assert steps == (NOW, NOW + 1)
    assert commands == tuple(WrenchCommand(Wrench(8.0), NOW, arrived) for arrived in (False, True))
    assert samples == tuple(StateSample(flight.state, NOW, arrived) for arrived in (False, is_new))
    assert not flight._is_state_new


@pytest.mark.parametrize(
    ("phase", "refused"),
    [
        (Phase.STREAM, "not ready: recorder"),
        (Phase.MODE, "not ready: recorder"),
        (Phase.ARM, "not ready: recorder"),
        (Phase.STANDBY, "the flight does not arm: standby"),
        (Phase.RELEASED, "the flight does not arm: released"),
        (Phase.SPOOL_UP, ""),
        (Phase.FLY, ""),
        (Phase.RETURN, ""),
        (Phase.LAND, ""),
    ],
)
def test_a_node_that_fails_speaks_against_arming_and_never_against_the_mode_that_flies(phase, refused):
    flight = Mock(phase=phase)
    flight.leader.handshake.missing.return_value = ["recorder"]
    assert AutopilotFlight.arming_refusal(flight) == refused


@pytest.mark.parametrize(
    ("reasons", "checks_pass", "told"),
    [
        ((), True, ""),
        (("PreArm: Compass not healthy (1)",), True, "PreArm: Compass not healthy (1)"),
        (("(1) compass",), False, "pre-flight checks fail; (1) compass"),
    ],
)
def test_what_it_says_against_a_flight_is_told_with_its_own_brackets(reasons, checks_pass, told, monkeypatch):
    made = Mock()
    monkeypatch.setattr("quad_autopilot.autopilot_flight.AutopilotStatus", made)
    monkeypatch.setattr("quad_autopilot.autopilot_flight.set_stamp", Mock())
    flight = Mock(phase=Phase.FLY, sequence=Memory(Phase.FLY), _told={}, large_resets=0)
    flight.leader.elapsed_ns = 0
    flight.said = Autopilot("GUIDED", Control.OURS, armed=True, checks_pass=checks_pass, reasons=reasons)
    AutopilotFlight._tell(flight, 1.0)
    assert made.call_args.kwargs["reasons"] == told


@pytest.mark.parametrize("counter", [4, None])
@pytest.mark.parametrize("shift", [Vec3(), Vec3(3.0, -1.0, 0.5)])
def test_ground_and_home_move_with_a_reset_and_not_with_the_vehicle(shift, counter):
    east, up = 10.0, 1.0  # m/s
    rests = (math.cos(0.15), 0.0, 0.0, math.sin(0.15))
    first = odometry.Sample(
        0, 1_000_000, 1, 1, (0.0, 0.0, -2.0), (1.0, 0.0, 0.0, 0.0), (0.0, east, -up), (0.0, 0.0, 0.0), counter
    )
    north, ahead, higher = shift.y, 0.01 * east + shift.x, 0.01 * up + shift.z
    turned = first._replace(timestamp_sample=1_010_000, position=(north, ahead, -2.0 - higher), q=rests)
    if counter is not None:
        turned = turned._replace(reset_counter=counter + 1)
    flight = Mock(is_over=False, sample=first, state=odometry.state(first), phase=Phase.FLY, _home=Vec3(5.0, 6.0, 1.0))
    flight.settings.reset_limit, flight.lift = 0.3, standing(1.0)._replace(on_ground=False)
    flight.commander.armed = True
    assert AutopilotFlight.take(flight, turned).accepted
    assert flight._home == pytest.approx((5.0 + shift.x, 6.0 + shift.y, 1.0 + shift.z))
    assert flight.lift.ground_z == pytest.approx(1.0 + shift.z)

"""The flight's side of a vehicle that an autopilot flies: states in, the way to the flight and back, what ends it.

A bridge has one, hands it each estimate (``take``) and each setpoint (``accepted``). Every ``BEAT`` s of its ``clock``
it calls ``begin_step``, then ``step``, and sends what that returns.

Publishes: state (VehicleState), actuation (Actuation), flight/autopilot (AutopilotStatus), and what leads a flight
(``quad_node.flight_leader``).
"""

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from quad_autopilot import arming, odometry
from quad_autopilot.arming import Output, Setpoint
from quad_autopilot.autopilot import (
    COMMANDS,
    NAV_LAND,
    Ack,
    Autopilot,
    Control,
    Profile,
    Request,
    Stamps,
    against,
    because,
    listed,
)
from quad_autopilot.evidence import Inputs, Intent, Memory, Phase
from quad_autopilot.parameters import Flier
from quad_core.cascade import ATTITUDE, STAGES
from quad_core.cycle import seconds
from quad_core.enumerations import GuardReason
from quad_core.geometry import ZERO, add, norm, subtract, tilt
from quad_core.lift_off import Standing, lifted_off, standing
from quad_core.parameters import ParameterError
from quad_core.types import Actuation, AttitudeThrust, VehicleState, Wrench, with_ground
from quad_core.vehicle import level_hover
from quad_guard.checks import StateSample, WrenchCommand, broken_limit, within_thrust_range
from quad_guard.guard import REASONS
from quad_msgs.msg import AutopilotStatus, FlightMode, FlightState
from quad_node.codec import UNUSABLE, Stamped, set_stamp, unpacker
from quad_node.command_link import CommandLink
from quad_node.flight_leader import FlightLeader
from quad_node.flight_node import FlightNode, nothing
from quad_node.topics import message_type

BEAT = 0.02  # seconds between two steps of the sequence, and between two heartbeats
LOOK = 0.002  # seconds between two looks at a link that is no topic
OVER = (FlightState.ENDED, FlightState.FAILED)
_SPACINGS = 200
_RESET_TILT, _RESET_HEADING = math.radians(10.0), math.radians(18.0)
"""Jumps that are flown through. PX4 turns its heading by 4 to 26 degrees when it first trusts the compass in the air;
the guard refuses samples from 20 degrees on."""
_LAST_WORDS = 3
_OURS = (Phase.FLY, Phase.RETURN)
_MOTORS_MAY_TURN = (Phase.SPOOL_UP, *_OURS, Phase.LAND, Phase.CLIMB, Phase.DISARM, Phase.HAND_BACK)
_BLAMED_FOR = 1.0  # s after this process stood still in which a flight that fails has failed by that
_TELL_EVERY, _COMMANDER_ENDS = 0.5, 1.0  # s between two messages on flight/autopilot; for the commander to end a flight


class Taken(NamedTuple):
    """What became of an estimate."""

    accepted: bool = False
    published: bool = False


class AutopilotFlight:
    """Arms an autopilot, flies it with the controllers' commands, lands it.

    What the bridge sets: ``profile``, how the autopilot is asked; ``said``, what it says of itself; ``ack``, its answer
    to the last request; ``spoke_at``, when it last sent anything, in s of ``clock``; ``stop``, why the flight must end
    now; ``predicted``, what the rotors will make of the last setpoint; ``by_attitude``: it is flown by
    attitude_setpoint and the guard judges states alone, else by wrench_setpoint and the guard judges both.

    What it reads: ``sample`` and ``state``, the last estimate, ``heard`` at s of ``clock``; ``origin``, the estimate's
    time of step 0 in us, -1 before; ``lift``, where the ground is; ``broken_limit``, which limit of the step is broken.
    """

    def __init__(
        self,
        kind: str,
        profile: Profile,
        *,
        ask: Callable[[Request], None],
        activate: Callable[[], None] = nothing,
        progress: Callable[[], None] = nothing,
        missing: Callable[[], list[str]] = list,
        refusal: Callable[[], str] = str,
        shut_down: Callable[[], None] = nothing,
        clock: Callable[[], float] = time.monotonic,
        predicts: bool = True,
    ) -> None:
        """Set up the flight's side; raises as FlightNode.

        ``ask`` sends a request. ``activate``: the flight begins, the next estimate is step 0. ``progress``: a wrench
        has come. ``missing``: what must come before the sequence begins. ``refusal``: what speaks against a flight.
        ``predicts`` false: the bridge publishes what the rotors really did.
        """
        self.node = node = FlightNode(kind, watch=self._watch, deactivate=self._deactivate, shut_down=shut_down)
        self.settings, self.profile, self.clock = node.settings, profile, clock
        self.leader = leader = FlightLeader(
            node,
            activate=self._begin,
            progress=progress,
            missing=self._prepares,
            comes_down=self._comes_down,
            clock=clock,
        )
        self.commander = _commander_of(leader)
        self._send_request, self._activate, self._missing, self._refused = ask, activate, missing, refusal
        self._predicts, self.predicted, self.by_attitude = predicts, Actuation(), True
        self.said: Autopilot | None = None
        self.ack: Ack | None = None
        self.sequence = Memory()
        self.state: VehicleState | None = None
        self.sample: odometry.Sample | None = None
        self.stop, self.origin, self.heard, self.spoke_at = "", -1, -math.inf, -math.inf
        self._unanswered_at, self._beat_at = math.inf, math.inf
        self._pause, self._paused_at = "", -math.inf
        self._is_landing = self._has_climbed = False
        self.lift, self._standing = standing(0.0), Standing()
        self.limits, self.broken_limit, self._home = leader.guard.parameters.step, "", ZERO
        self._spacings: deque[int] = deque(maxlen=_SPACINGS)
        self.large_resets = 0
        self._thrust: float | None = None
        self._guarded_step, self._is_command_new, self._is_state_new = -1, False, False
        self.guarded = Wrench()
        self._told: dict[str, Any] = {}
        self._tell_at = -math.inf
        self._reported: tuple[str, ...] = ()
        self._had_failsafe = False
        self._autopilot_out = node.links.publisher("flight/autopilot", match=False)
        self._state_out, self.actuation_out = leader.output("state"), leader.output("actuation")
        self._unpack_setpoint = unpacker(AttitudeThrust, message_type(AttitudeThrust), run=node.run)
        leader.estimator, leader.guard.killed = profile.name, "the autopilot lands by itself"
        node.measures.append(self._measured)

    @property
    def phase(self) -> Phase:
        """Where the vehicle is between ground and ground."""
        return self.sequence.phase

    @property
    def is_over(self) -> bool:
        """Whether the flight has ended."""
        return self.leader.phase in OVER

    def stamps(self) -> Stamps:
        """Return the autopilot's time as its last state gave it."""
        return Stamps(self.sample.timestamp, self.sample.timestamp_sample) if self.sample else Stamps()

    def take(self, sample: odometry.Sample) -> Taken:
        """Take an estimate: drop it, or accept it and answer it with a state."""
        if self.is_over:
            return Taken()
        last = self.sample
        if refused := odometry.refusal(sample, last.timestamp_sample if last else -1):
            self.node.events.counts["rejected"] += 1
            text = f"{self.profile.state}: {refused}; dropped"
            self.node.events.warn("rejected_odometry", text, self.leader.elapsed_ns)
            return Taken()
        state = odometry.state(sample)
        elapsed, is_shifted = 0, False
        if last is not None and self.state is not None:
            elapsed = sample.timestamp_sample - last.timestamp_sample
            self._spacings.append(1000 * elapsed)
            jump, uncounted = odometry.jump(self.state, state, 1e-6 * elapsed), sample.reset_counter is None
            is_reset = odometry.is_reset(jump, self.settings.reset_limit)
            if is_reset if uncounted else sample.reset_counter != last.reset_counter:
                is_shifted = self._note_reset(jump)
                self._home = add(self._home, jump.shift)  # ground and home move along
                self.lift = self.lift._replace(ground_z=self.lift.ground_z + jump.shift.z)
        is_flying = self.phase in (Phase.FLY, Phase.LAND, Phase.CLIMB, Phase.RETURN)
        is_flying = is_flying and self.commander.armed  # else its rotors idle: it stands
        if not is_flying:
            self._standing.note(1e-6 * sample.timestamp_sample, state)
            self._home = state.p_w
        self.lift = lifted_off(self.lift, state, is_flying, 1e-6 * elapsed)
        state = with_ground(state, self.lift.ground_z, self.lift.on_ground)
        if self.phase in _OURS and is_flying:
            self._watch_limits(state)
        self.sample, self.state, self.heard = sample, state, self.clock()
        # the commander looks at the vehicle before it is armed, and while the autopilot flies it
        is_due = self.leader.phase == FlightState.FLYING and self.phase != Phase.RELEASED
        is_published = is_due and self._publish_step(sample, state)
        self._show_guard(is_published, is_shifted)
        return Taken(True, is_published)

    def _watch_limits(self, state: VehicleState) -> None:
        """Note the first limit of the step that ``state`` is beyond."""
        broken = broken_limit(self.limits, self._home, state.ground_z, state.p_w, state.v_w, state.q_wb)
        if broken == GuardReason.GOOD or self.broken_limit:
            return
        at, lean = subtract(state.p_w, self._home), math.degrees(tilt(state.q_wb))
        here = f"{at.x:.2f} {at.y:.2f} {state.p_w.z - state.ground_z:.2f} m from the take-off"
        self.broken_limit = f"{REASONS[broken]} (found {here}, {norm(state.v_w):.2f} m/s, {lean:.1f} deg)"

    def within_thrust_range(self, newtons: float) -> float:
        """Return the thrust in N that may go to the autopilot for one of ``newtons``."""
        height = self.state.p_w.z - self.state.ground_z if self.state else 0.0
        return within_thrust_range(self.leader.guard.parameters, self.node.vehicle, newtons, height)

    def _note_reset(self, jump: odometry.Jump) -> bool:
        """Report a jump of the estimate; return whether it is a shift that the guard need not doubt."""
        angles = f"{math.degrees(jump.tilt):.1f} deg of tilt, {math.degrees(jump.heading):.1f} deg of heading"
        text = f"the estimate jumped by {jump.distance:.2f} m, {angles}"
        turned = jump.tilt > _RESET_TILT or jump.heading > _RESET_HEADING
        is_large = turned or jump.distance > self.settings.reset_limit
        say = self.node.events.warn if is_large else self.node.events.info
        say("estimator_reset", text, self.leader.elapsed_ns, always=True)
        if self.phase == Phase.FLY and is_large:
            self.large_resets += 1
            self._tell(self.clock())  # before the state that jumped
        return not turned  # what it says of a heading must hold against the motion first

    def _publish_step(self, sample: odometry.Sample, state: VehicleState) -> bool:
        """Publish what was made of the last command, and the state; stamps stand on the plant period's grid."""
        node, leader, first = self.node, self.leader, self.origin < 0
        if first:
            self.origin = sample.timestamp_sample
        step = round(1000 * (sample.timestamp_sample - self.origin) / node.flight.plant_period)
        if not first and step <= node.current_step:
            node.events.counts["crowded_states"] += 1
            return False
        if not first and self._predicts and self.is_obeyed():
            publisher, pack = self.actuation_out
            publisher.publish(pack(self.predicted, node.current_step, node.current_step + 1, leader.elapsed_ns))
        node.current_step = step
        leader.asks()
        self._unanswered_at = min(self._unanswered_at, self.clock())
        publisher, pack = self._state_out
        publisher.publish(pack(state, step, step + 1, leader.elapsed_ns))
        return True

    def accepted(self, payload: bytes) -> AttitudeThrust | None:
        """Return the setpoint of a payload if it is to be flown now; what is refused is reported."""
        try:
            stamped = self._unpack_setpoint(payload)
        except UNUSABLE as error:
            self.node.events.unusable("attitude_setpoint", payload, error)
            return None
        if refused := self._setpoint_refusal(stamped):
            self.node.events.reject("attitude_setpoint", refused, stamped.stamp_ns, "rejected_setpoint")
            return None
        self.note_command()
        setpoint: AttitudeThrust = stamped.value
        setpoint = setpoint._replace(thrust=self.within_thrust_range(setpoint.thrust))
        self._thrust = setpoint.thrust
        return setpoint if self.may_fly() and self.state is not None else None

    def _setpoint_refusal(self, stamped: Stamped) -> str:
        """Return why a setpoint is not flown, empty if it is; its age is judged as the guard judges a wrench's."""
        if not stamped.finite:
            return "a number that is not finite"
        if not odometry.is_attitude(stamped.value.q_wb):
            return "a quaternion that is not of length 1"
        late = seconds(self.node.current_step - stamped.step, self.node.flight.plant_period)
        limit = self.leader.guard.parameters.command.too_old
        return "" if 0.0 <= late <= limit else f"it answers a state {late:g} s old, expected 0 to {limit:g} s"

    def note_command(self) -> None:
        """Note that a command has come: no state waits for one any more."""
        self._unanswered_at, self._is_command_new = math.inf, True

    def may_fly(self) -> bool:
        """Return whether the controllers' commands go to the autopilot."""
        if self.broken_limit or not self.commander.armed or self._intent() == Intent.CLIMB:
            return False
        # what waited while this process stood still is old, and its guard would count that time as one without a state
        if self.clock() - self._beat_at - BEAT > self.settings.arming.state_timeout:
            return False
        return self.phase == Phase.RETURN or (self.phase == Phase.FLY and self.is_obeyed())

    def is_obeyed(self) -> bool:
        """Return whether the autopilot is in our mode; once it has taken over to land, never again."""
        ours = self.said is not None and self.said.control == Control.OURS
        # it may name our mode again when it has landed and disarmed
        self._is_landing = self._is_landing or (self.phase == Phase.LAND and not ours)
        return ours and not self._is_landing

    def begin_step(self) -> bool:
        """Return whether a step is due: all nodes were ready, and the flight is not over."""
        waits = self.leader.phase == FlightState.WAITING and self.leader.handshake.missing()
        if self.is_over or waits:  # a node that fails later neither stops the heartbeat nor the way to the ground
            return False
        now = self.clock()
        # no other node is blamed for a pause of this process: the states that came meanwhile are still to be read
        paused, self._beat_at = now - self._beat_at - BEAT, now
        self.leader.note_pause(paused)
        if paused > self.settings.arming.state_timeout:
            self._pause, self._paused_at = self.leader.stood_still, now
        if self.leader.stood_still:
            self.heard = min(self.heard + paused, now)
            self._unanswered_at += min(paused, max(now - self._unanswered_at, 0.0))
        return True

    def step(self) -> Output:
        """Take the sequence on, ask what is due, end a flight that is over; return what to send now."""
        now, phase, leader = self.clock(), self.phase, self.leader
        if phase == Phase.STREAM and self._missing():
            return arming.QUIET
        self.step_guard()
        if leader.guard.taken_over and leader.guard.memory.reason != GuardReason.REQUESTED:
            self.stop = self.stop or leader.failure
        if leader.gives_up:
            self.stop = self.stop or leader.cause
        intent = self._intent()
        arms = self.commander.answer_text if intent == Intent.IDLE else ""  # what the commander still waits for
        inputs = Inputs(
            now,
            autopilot_time=1e-6 * self.stamps().now,
            autopilot=self.said,
            ack=self.ack,
            command_age=max(now - self._unanswered_at, 0.0),
            state_age=now - self.heard,
            refusal=self._refusal() if phase == Phase.STREAM else arms,
            stop=self.stop,
            broken_limit=self.broken_limit,
            silence=now - self.spoke_at,
            intent=intent,
            is_over=self.commander.is_over,
            moves=phase == Phase.STREAM and bool(self._moves()),
        )
        before = self.sequence.reason
        output, self.sequence = arming.step(self.profile, self.settings.arming, self.sequence, inputs)
        if output.reason != before and now - self._paused_at < _BLAMED_FOR:
            leader.cause = leader.cause or self._pause
        self._tell(now)
        self._report_reasons()
        self.ack = None
        if output.request is not None:
            self._ask(output.request)
        if output.phase in (Phase.LANDED, Phase.RELEASED):
            self._end(output.reason, now)
        return output

    def step_guard(self) -> None:
        """Bring the guard up to now, in the autopilot's own time: ``guarded`` is what it lets through or flies.

        It rests before the first command, and while the autopilot flies.
        """
        leader, node, state, given = self.leader, self.node, self.state, self._given()
        if self.phase in (Phase.CLIMB, Phase.RETURN):  # nothing grows old meanwhile
            self._rest_guard()
            return
        if given is None or state is None or self.origin < 0 or not self.is_obeyed():
            return
        now = node.current_step + int(1e9 * (self.clock() - self.heard)) // node.flight.plant_period
        for step in range(self._guarded_step + 1 if self._guarded_step >= 0 else now, now + 1):
            newest = step == now
            command = given._replace(arrived=newest and given.arrived)
            sample = StateSample(state, node.current_step, newest and self._is_state_new)
            self.guarded = leader.guarded(command, sample, step)
            self._guarded_step = step
            if newest:
                self._is_command_new = self._is_state_new = False

    def _given(self) -> WrenchCommand | None:
        """Return the newest command; by attitude what is known of it, its thrust, which is never too old."""
        if self.by_attitude:
            known = self._thrust
            return None if known is None else WrenchCommand(Wrench(known, ZERO), self.node.current_step, True)
        newest = self.leader.wrenches.newest
        return WrenchCommand(newest.value, newest.step, self._is_command_new) if newest is not None else None

    def _show_guard(self, is_published: bool, is_shifted: bool) -> None:
        """Let the guard see an estimate; it begins anew where the autopilot has moved it and the guard does not fly."""
        if is_shifted and not self.leader.guard.taken_over:  # it would refuse what lies a metre away
            self._rest_guard()
        self._is_state_new |= is_published

    def _rest_guard(self) -> None:
        self.leader.guard.rest(self.node.current_step)
        self._guarded_step = -1

    def safe_thrust(self, setpoint: Setpoint) -> float | None:
        """Return the thrust in N of a safe setpoint, level or at rest; None where another one, or none, is due."""
        if self.state is None or setpoint not in (Setpoint.IDLE, Setpoint.LEVEL):
            return None
        return self.node.vehicle.mass * self.node.vehicle.gravity if setpoint == Setpoint.LEVEL else 0.0

    def level(self, newtons: float) -> AttitudeThrust:
        """Return level attitude at the present heading with a thrust in N."""
        return level_hover(self.node.vehicle, self.state or VehicleState())._replace(thrust=newtons)

    def _intent(self) -> Intent:
        """Return what the commander's mode wants of the autopilot."""
        mode = self.commander.mode.value.mode
        if mode == FlightMode.PILOT:
            return Intent.GROUND if self.phase == Phase.STANDBY else Intent.FLY
        own = self.settings.arming
        self._has_climbed = self._has_climbed or self.phase == Phase.RETURN
        climbs = own.takeoff == Flier.AUTOPILOT and not self._has_climbed
        return {
            FlightMode.DISARMED: Intent.GROUND,
            FlightMode.ARMING: Intent.IDLE,
            FlightMode.TAKEOFF: Intent.CLIMB if climbs else Intent.FLY,
            FlightMode.LAND: Intent.LAND if own.landing == Flier.AUTOPILOT else Intent.FLY,
            FlightMode.DESCEND: Intent.LAND,
            FlightMode.KILL: Intent.KILL,
        }.get(mode, Intent.FLY)

    def _tell(self, now: float) -> None:
        """Publish what the autopilot says, when it changes and twice a second."""
        phase, said = self.phase, self.said
        if said is None:
            return
        # on the ground what speaks against arming, in flight what is new since it began
        usual = self.sequence.usual if phase in _MOTORS_MAY_TURN else said.reasons if said.checks_pass else ()
        found = {
            "armed": phase in _MOTORS_MAY_TURN and phase != Phase.SPOOL_UP,
            "flies": phase in (Phase.CLIMB, Phase.RETURN, Phase.LAND),
            "pilot": math.isfinite(self.sequence.left_at)
            or (phase == Phase.RELEASED and said.control == Control.OTHER),
            "landed": said.landed or phase == Phase.LANDED,  # disarmed by itself after its landing
            "position_lost": said.position_lost,
            "resets": self.large_resets,
            "battery": math.nan if math.isnan(said.battery) else round(said.battery, 2),
            "mode": said.mode,
            "reasons": against(said, usual),
        }
        if found == self._told and now < self._tell_at:
            return
        self._told, self._tell_at = found, now + _TELL_EVERY
        message = AutopilotStatus(run=self.node.run, **found)
        set_stamp(message.stamp, max(self.leader.elapsed_ns, 0))
        self._autopilot_out.publish(message)

    def _report_reasons(self) -> None:
        """Report as events what the autopilot newly says against a flight, and that its failsafe acts."""
        said, name, events, stamp = self.said, self.profile.name, self.node.events, self.leader.elapsed_ns
        if said is None:
            return
        if new := [reason for reason in said.reasons if reason not in self._reported]:
            mode = "" if said.control == Control.UNSAID else f" in {said.mode}"
            say = events.warn if self.phase in _MOTORS_MAY_TURN else events.info
            say("autopilot_reasons", f"{name}{mode} reports against a flight: {listed(new)}", stamp, always=True)
        if said.failsafe and not self._had_failsafe:
            text = f"{name}'s failsafe acts: mode {said.mode}{because(said, self.sequence.usual)}"
            events.warn("autopilot_failsafe", text, stamp, always=True)
        self._reported, self._had_failsafe = said.reasons, said.failsafe

    def arming_refusal(self) -> str:
        """Return why the vehicle must not be armed in our mode now; empty where it may, or flies."""
        phase = self.phase
        if phase in (Phase.STANDBY, Phase.LANDED, Phase.RELEASED):
            return f"the flight does not arm: {phase.name.lower()}"
        if phase in _MOTORS_MAY_TURN:
            return ""
        if missing := self.leader.handshake.missing():
            return f"not ready: {', '.join(missing)}"
        if phase not in (Phase.STREAM, Phase.MODE):
            return ""
        return self._refusal() or self._moves()

    def _moves(self) -> str:
        """Return how the estimate moves while the vehicle stands; empty if it rests."""
        return self._standing.refusal(self.settings.arming.speed, self.profile.state)

    def _refusal(self) -> str:
        """Return why the flight must not begin."""
        node, period_of = self.node, self.leader.handshake.period
        periods = {stage.role: period_of(stage.role) for stage in STAGES if stage.role in node.roles}
        misfit = odometry.misfit(node.flight.plant_period, periods, self._spacings, self.profile.state)
        return self._refused() or misfit

    def _ask(self, request: Request) -> None:
        text = f"{COMMANDS[request.command]}, attempt {request.attempt + 1}"
        self.node.events.info(f"{self.profile.name.lower()}_command", text, self.leader.elapsed_ns, always=True)
        self._send_request(request)

    def _begin(self) -> None:
        """Begin the flight, and say what a reader of the bag needs to know."""
        if self.by_attitude and ATTITUDE in self.node.roles:
            text = f"{self.profile.name} gets no torque: {ATTITUDE} answers in shadow, no rotor follows it"
            self.node.events.info("attitude_in_shadow", text, always=True)
        if self._predicts:
            text = "actuation is a prediction of the bridge's mixer model; rotor speeds are unknown"
            self.node.events.info("actuation_predicted", text, always=True)
        self._activate()

    def _prepares(self) -> list[str]:
        """Return what the autopilot still has to do before step 0."""
        if missing := self._missing():
            return missing
        if self.phase == Phase.STANDBY:
            return []
        more = f": {moves}" if self.sample is not None and (moves := self._moves()) else ""
        return [f"{self.profile.name} ({self.phase.name.lower()}{more})"]

    def _watch(self) -> None:
        self.leader.watch()

    def _comes_down(self, reason: str) -> bool:
        """Return whether the motors may turn, and have the vehicle land then."""
        if self.phase in _MOTORS_MAY_TURN:
            self.stop = self.stop or reason
        return self.phase in _MOTORS_MAY_TURN

    def _end(self, reason: str, now: float) -> None:
        """End the flight of a sequence that is over, once the commander has taken note of it."""
        leader = self.leader
        if leader.phase == FlightState.FLYING:
            if not self.commander.is_over and now - self.sequence.since < _COMMANDER_ENDS:
                return  # it takes note of what has become of the vehicle
            is_seen = self.commander.is_over or self.phase == Phase.RELEASED
            unseen = "" if is_seen else f"{self.profile.name} disarmed before the mission had ended"
            cause = "" if leader.cause in reason else leader.cause
            reason = "; ".join(dict.fromkeys(filter(None, (cause, reason, self.commander.outcome, unseen))))
        leader.end(FlightState.FAILED if reason else FlightState.ENDED, reason)

    def fail(self, reason: str) -> None:
        """End the flight as it is, asking nothing of the autopilot any more."""
        self.sequence = self.sequence._replace(phase=Phase.RELEASED)
        self.leader.end(FlightState.FAILED, reason)

    def _deactivate(self, ended: FlightState) -> None:
        """Have the autopilot land after a signal; the bridge cannot stay to see it."""
        flown = self.phase in _MOTORS_MAY_TURN and self.is_obeyed()  # a pilot who has it keeps it
        for attempt in range(_LAST_WORDS if flown else 0):
            self._ask(Request(NAV_LAND, attempt=attempt))
            time.sleep(BEAT)
        self.fail(ended.reason + (f"; {self.profile.name} was asked to land" if flown else ""))
        self.node.exit_code = 1

    def _measured(self) -> dict[str, float]:
        return {"autopilot_phase": int(self.phase), "actuation_predicted": int(self._predicts)}


def _commander_of(leader: FlightLeader) -> CommandLink:
    """Return the link to the commander; raises ParameterError for a flight that no autopilot can take part in."""
    if leader.node.lockstep:
        raise ParameterError("flight.mode: found lockstep, expected realtime: an autopilot's clock cannot be halted")
    if leader.link is None:
        example = "scripts/fly --mission takeoff:2,case2,hold:5,land"
        raise ParameterError(f"flight.roles: found no commander, expected one: {example}")
    return leader.link

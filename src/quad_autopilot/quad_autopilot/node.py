"""The vehicle interface of every autopilot: states in, the way to the flight and back, what ends it.

``AutopilotNode`` is the flight's side; the autopilot's side is an ``AutopilotInterface``: how a request, a heartbeat
and a setpoint are sent. It calls ``on_sample`` of the node with each estimate, and sets its own ``autopilot`` and
``ack`` when the autopilot reports its status.
"""

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from quad_autopilot import arming, odometry
from quad_autopilot.arming import Phase, Setpoint, Wish
from quad_autopilot.autopilot import (
    COMMANDS,
    NAV_LAND,
    Ack,
    Autopilot,
    Control,
    Profile,
    Request,
    Stamps,
    because,
    listed,
)
from quad_autopilot.parameters import Flier
from quad_core.cascade import ATTITUDE, POSITION, STAGE, STAGES
from quad_core.cycle import seconds
from quad_core.lift_off import lifted_off, standing
from quad_core.parameters import ParameterError
from quad_core.safe import level_hover
from quad_core.standing import Standing
from quad_core.types import Actuation, AttitudeThrust, VehicleState, with_ground
from quad_msgs.msg import AutopilotStatus, FlightEvent, FlightMode, FlightState
from quad_node.codec import UNUSABLE, Stamped, unpacker
from quad_node.conversion import set_stamp
from quad_node.topics import message_type
from quad_node.vehicle_node import VehicleNode

BEAT = 0.02
"""Seconds between two steps of the sequence, and between two heartbeats."""
LOOK = 0.002
"""Seconds between two looks at a link that is no topic."""
OVER = (FlightState.ENDED, FlightState.FAILED)
_SPACINGS = 200
_RESET_TILT, _RESET_HEADING = math.radians(10.0), math.radians(18.0)
"""Jumps that are flown through. PX4 turns its heading by 4 to 26 degrees when it first trusts the compass in the air;
the guard refuses samples from 20 degrees on."""
_LAST_WORDS = 3
_ALOFT = (Phase.SPOOL_UP, Phase.FLY, Phase.LAND, Phase.CLIMB, Phase.RETURN, Phase.DISARM)
_TELL_EVERY, _COMMANDER_ENDS = 0.5, 1.0  # s between two messages on flight/autopilot; for the commander to end a flight


class AutopilotInterface:
    """One autopilot: what it reports, and how it is asked and sent. A subclass overrides what its autopilot has.

    ``predicted`` is what the rotors will make of the last setpoint; ``is_predicting`` false: the interface publishes
    what they really did. ``spoke_at``: when the autopilot last sent anything, in s of ``clock``.
    """

    profile: Profile
    predicted: Actuation
    is_predicting = True
    by_attitude = True
    """Whether it is flown by attitude_setpoint, else by wrench_setpoint."""
    has_own_beats = False
    """Whether the interface itself calls the node's ``on_beat`` every ``BEAT`` s of its ``clock``."""

    def __init__(self, node: "AutopilotNode") -> None:
        """Nothing is known of the autopilot yet."""
        self.node, self.settings = node, node.settings
        self.autopilot: Autopilot | None = None
        self.ack: Ack | None = None
        self.spoke_at = -math.inf

    def clock(self) -> float:
        """Return the time in s by which the flight is watched: the steady clock, unless a simulator halts time."""
        return time.monotonic()

    def on_ready(self) -> None:
        """Report what a reader of the bag needs to know of the autopilot, such as a law that no rotor follows."""
        if self.by_attitude and ATTITUDE in self.node.roles:
            text = f"{self.profile.name} gets no torque: {ATTITUDE} answers in shadow, no rotor follows it"
            self.node.event(FlightEvent.INFO, "attitude_in_shadow", text, always=True)

    def missing(self) -> list[str]:
        """Return what must come before the sequence begins."""
        return []

    def refusal(self) -> str:
        """Return what speaks against a flight; empty if nothing."""
        return ""

    def take(self) -> None:
        """Take what has come; called before each beat."""

    def send_request(self, request: Request) -> None:
        """Send a command."""
        raise NotImplementedError

    def send_heartbeat(self) -> None:
        """Send the companion's heartbeat, where setpoints alone do not keep the mode."""

    def send_attitude(self, setpoint: AttitudeThrust, state: VehicleState) -> None:
        """Send an attitude and a thrust in N."""

    def send_safe(self, output: Setpoint, newtons: float, state: VehicleState) -> None:  # noqa: ARG002
        """Send level attitude, or no torque, with a thrust in N; ``output`` is IDLE or LEVEL."""
        self.send_attitude(level_hover(self.node.vehicle, state)._replace(thrust=newtons), state)

    def on_begin(self) -> None:
        """Note that the next estimate is step 0."""

    def on_shift(self) -> None:
        """Note that the autopilot has moved its estimate and says so: the next one is no jump of the vehicle."""

    def on_accepted(self, sample: odometry.Sample) -> None:
        """Note that an estimate was accepted."""

    def on_published(self) -> None:
        """Note that the node's current step has a new state."""

    def on_wrench(self) -> None:
        """Pass on a wrench of the node that has just come."""

    def measurements(self) -> dict[str, float]:
        """Return further diagnostics."""
        return {}

    def close(self) -> None:
        """Close the link."""


class AutopilotNode(VehicleNode):
    """Arms an autopilot, flies it with the controllers' commands, lands it."""

    def __init__(self, kind: str, make: Callable[["AutopilotNode"], AutopilotInterface]) -> None:
        """Set up the flight's side, then ``make`` the autopilot's; raises as FlightNode, and as ``make``."""
        super().__init__(kind)
        self.settings = self.resolved.node
        if self.lockstep:
            raise ParameterError(
                "flight.mode: found lockstep, expected realtime: an autopilot's clock cannot be halted"
            )
        if self.link is None:
            raise ParameterError(
                "flight.roles: found no commander, expected one: scripts/fly --mission takeoff:2,case2,hold:5,land"
            )
        self.commander = self.link
        self.sequence = arming.Memory()
        self.state: VehicleState | None = None
        self.sample: odometry.Sample | None = None
        self.stop, self.origin, self.heard = "", -1, -math.inf
        self._unanswered_at, self._beat_at = math.inf, math.inf
        self._is_landing = self._has_climbed = False
        self.lift, self._standing = standing(0.0), Standing()
        self._spacings: deque[int] = deque(maxlen=_SPACINGS)
        self.large_resets = 0
        self._told: dict[str, Any] = {}
        self._tell_at = -math.inf
        self._reported: tuple[str, ...] = ()
        self._had_failsafe = False
        self._autopilot_out = self.publisher("flight/autopilot", match=False)
        self._state_out, self.actuation_out = self.output("state"), self.output("actuation")
        self.interface = make(self)
        self.estimator = self.profile.name
        self.guard.killed = "the autopilot lands by itself"
        if self.interface.by_attitude:
            self._take_attitude()
        if not self.interface.has_own_beats:
            self.every(BEAT, self.on_beat)

    def clock(self) -> float:
        """Return the time in s by which the flight is watched: the autopilot's where a simulator halts it."""
        return self.interface.clock()

    @property
    def profile(self) -> Profile:
        """How the autopilot is asked."""
        return self.interface.profile

    def stamps(self) -> Stamps:
        """Return the autopilot's time as its last state gave it."""
        return Stamps(self.sample.timestamp, self.sample.timestamp_sample) if self.sample else Stamps()

    def _take_attitude(self) -> None:
        """Fly by attitude_setpoint; an attitude law that runs all the same stays in shadow."""
        self._unpack_setpoint = unpacker(AttitudeThrust, message_type(AttitudeThrust), run=self.run)
        self.subscribe(STAGE[POSITION].gives, self._on_setpoint, raw=True)

    def on_sample(self, sample: odometry.Sample) -> None:
        """Take an estimate: accept or drop it, and answer it."""
        if self.phase in OVER:
            return
        last = self.sample
        if refused := odometry.refusal(sample, last.timestamp_sample if last else -1):
            self.counters["rejected"] += 1
            text = f"{self.profile.state}: {refused}; dropped"
            self.event(FlightEvent.WARNING, "rejected_odometry", text, self.elapsed_ns)
            return
        state = odometry.state(sample)
        elapsed = 0
        if last is not None and self.state is not None:
            elapsed = sample.timestamp_sample - last.timestamp_sample
            self._spacings.append(1000 * elapsed)
            jump, uncounted = odometry.jump(self.state, state, 1e-6 * elapsed), sample.reset_counter is None
            is_reset = odometry.is_reset(jump, self.settings.reset_limit)
            if is_reset if uncounted else sample.reset_counter != last.reset_counter:
                self._on_reset(jump)
                moved = state.p_w.z - self.state.p_w.z
                self.lift = self.lift._replace(ground_z=self.lift.ground_z + moved)  # it moves along
        is_flying = self.sequence.phase in (Phase.FLY, Phase.LAND, Phase.CLIMB, Phase.RETURN)
        is_flying = is_flying and self.commander.armed  # else its rotors idle: it stands
        if not is_flying:
            self._standing.note(1e-6 * sample.timestamp_sample, state)
        self.lift = lifted_off(self.lift, state, is_flying, 1e-6 * elapsed)
        state = with_ground(state, self.lift.ground_z, self.lift.on_ground)
        self.sample, self.state, self.heard = sample, state, self.clock()
        # the commander looks at the vehicle before it is armed, and while the autopilot flies it
        if self.phase == FlightState.FLYING and self.sequence.phase != Phase.RELEASED:
            self._publish_step(sample, state)
        self.interface.on_accepted(sample)

    def is_obeyed(self) -> bool:
        """Return whether the autopilot is in our mode; once it has taken over to land, never again."""
        said = self.interface.autopilot
        ours = said is not None and said.control == Control.OURS
        # it may name our mode again when it has landed and disarmed
        self._is_landing = self._is_landing or (self.sequence.phase == Phase.LAND and not ours)
        return ours and not self._is_landing

    def _on_reset(self, jump: odometry.Jump) -> None:
        angles = f"{math.degrees(jump.tilt):.1f} deg of tilt, {math.degrees(jump.heading):.1f} deg of heading"
        text = f"the estimate jumped by {jump.distance:.2f} m, {angles}"
        turned = jump.tilt > _RESET_TILT or jump.heading > _RESET_HEADING
        is_large = turned or jump.distance > self.settings.reset_limit
        severity = FlightEvent.WARNING if is_large else FlightEvent.INFO
        self.event(severity, "estimator_reset", text, self.elapsed_ns, always=True)
        if not turned:  # what it says of a heading must hold against the motion first
            self.interface.on_shift()
        if self.sequence.phase == Phase.FLY and is_large:
            self.large_resets += 1
            self._tell(self.clock())  # before the state that jumped

    def _publish_step(self, sample: odometry.Sample, state: VehicleState) -> None:
        """Publish what was made of the last command, and the state; stamps stand on the plant period's grid."""
        first, period = self.origin < 0, self.flight.plant_period
        if first:
            self.origin = sample.timestamp_sample
        step = round(1000 * (sample.timestamp_sample - self.origin) / period)
        if not first and step <= self.current_step:
            self.counters["crowded_states"] += 1
            return
        if not first and self.interface.is_predicting and self.is_obeyed():
            publisher, pack = self.actuation_out
            publisher.publish(pack(self.interface.predicted, self.current_step, self.current_step + 1, self.elapsed_ns))
        self.current_step = step
        self.interface.on_published()
        self.asked_at = time.monotonic()
        self.input_watch.note_state()
        self._unanswered_at = min(self._unanswered_at, self.clock())
        publisher, pack = self._state_out
        publisher.publish(pack(state, step, step + 1, self.elapsed_ns))

    def on_ready(self) -> None:
        """Have the autopilot's side report what it has to."""
        self.interface.on_ready()

    def begin(self) -> None:
        """Go: the next estimate is step 0."""
        if self.interface.is_predicting:
            text = "actuation is a prediction of the bridge's mixer model; rotor speeds are unknown"
            self.event(FlightEvent.INFO, "actuation_predicted", text, always=True)
        self.interface.on_begin()

    def prepare(self) -> list[str]:
        """Return what the autopilot still has to do before step 0."""
        phase = self.sequence.phase
        if phase == Phase.STANDBY:
            return self.interface.missing()
        more = f": {moves}" if self.sample is not None and (moves := self._moves()) else ""
        return self.interface.missing() or [f"{self.profile.name} ({phase.name.lower()}{more})"]

    def waits_for(self) -> list[str]:
        """Return what must come before the flight begins, the autopilot's part included."""
        return super().waits_for() or self.prepare()

    def progress(self) -> None:
        """Pass on a wrench that has just come."""
        self.interface.on_wrench()

    def on_given_up(self) -> None:
        """Have the autopilot land."""
        self.stop = self.stop or self.cause

    def _on_setpoint(self, payload: bytes) -> None:
        try:
            stamped = self._unpack_setpoint(payload)
        except UNUSABLE as error:
            self.unusable("attitude_setpoint", payload, error)
            return
        if refused := self._setpoint_refusal(stamped):
            self.reject("attitude_setpoint", refused, stamped.stamp_ns, "rejected_setpoint")
            return
        self.on_command()
        if self.may_fly() and self.state is not None:
            self.interface.send_attitude(stamped.value, self.state)

    def _setpoint_refusal(self, stamped: Stamped) -> str:
        """Return why a setpoint is not flown, empty if it is; its age is judged as the guard judges a wrench's."""
        if not stamped.finite:
            return "a number that is not finite"
        if not odometry.is_attitude(stamped.value.q_wb):
            return "a quaternion that is not of length 1"
        late, limit = seconds(self.current_step - stamped.step, self.flight.plant_period), self.guard.parameters.command
        if not 0.0 <= late <= limit.too_old:
            return f"it answers a state {late:g} s old, expected 0 to {limit.too_old:g} s"
        return ""

    def may_fly(self) -> bool:
        """Return whether the controllers' commands go to the autopilot."""
        if not self.commander.armed or self._wish() == Wish.CLIMB:
            return False
        return self.sequence.phase == Phase.RETURN or (self.sequence.phase == Phase.FLY and self.is_obeyed())

    def _wish(self) -> Wish:
        """Return what the commander's mode wants of the autopilot."""
        mode = self.commander.mode.value.mode
        if mode == FlightMode.PILOT:
            return Wish.GROUND if self.sequence.phase == Phase.STANDBY else Wish.FLY
        own = self.settings.arming
        self._has_climbed = self._has_climbed or self.sequence.phase == Phase.RETURN
        climbs = own.takeoff == Flier.AUTOPILOT and not self._has_climbed
        return {
            FlightMode.DISARMED: Wish.GROUND,
            FlightMode.ARMING: Wish.IDLE,
            FlightMode.TAKEOFF: Wish.CLIMB if climbs else Wish.FLY,
            FlightMode.LAND: Wish.LAND if own.landing == Flier.AUTOPILOT else Wish.FLY,
            FlightMode.DESCEND: Wish.LAND,
            FlightMode.KILL: Wish.KILL,
        }.get(mode, Wish.FLY)

    def _tell(self, now: float) -> None:
        """Publish what the autopilot says, when it changes and twice a second."""
        phase, said = self.sequence.phase, self.interface.autopilot
        if said is None:
            return
        # on the ground what speaks against arming, in flight what is new since it began
        usual = self.sequence.usual if phase in _ALOFT else said.reasons if said.checks_pass else ()
        found = {
            "armed": phase in _ALOFT and phase != Phase.SPOOL_UP,
            "flies": phase in (Phase.CLIMB, Phase.RETURN, Phase.LAND),
            "pilot": math.isfinite(self.sequence.left_at)
            or (phase == Phase.RELEASED and said.control == Control.OTHER),
            "landed": said.landed or phase == Phase.LANDED,  # disarmed by itself after its landing
            "position_lost": said.position_lost,
            "resets": self.large_resets,
            "battery": math.nan if math.isnan(said.battery) else round(said.battery, 2),
            "mode": said.mode,
            "reasons": because(said, usual).strip(" ()"),
        }
        if found == self._told and now < self._tell_at:
            return
        self._told, self._tell_at = found, now + _TELL_EVERY
        message = AutopilotStatus(run=self.run, **found)
        set_stamp(message.stamp, max(self.elapsed_ns, 0))
        self._autopilot_out.publish(message)

    def _report_reasons(self) -> None:
        """Report as events what the autopilot newly says against a flight, and that its failsafe acts."""
        said, name = self.interface.autopilot, self.profile.name
        if said is None:
            return
        severity = FlightEvent.WARNING if self.sequence.phase in _ALOFT else FlightEvent.INFO
        if new := [reason for reason in said.reasons if reason not in self._reported]:
            mode = "" if said.control == Control.UNSAID else f" in {said.mode}"
            text = f"{name}{mode} reports against a flight: {listed(new)}"
            self.event(severity, "autopilot_reasons", text, self.elapsed_ns, always=True)
        if said.failsafe and not self._had_failsafe:
            text = f"{name}'s failsafe acts: mode {said.mode}{because(said, self.sequence.usual)}"
            self.event(FlightEvent.WARNING, "autopilot_failsafe", text, self.elapsed_ns, always=True)
        self._reported, self._had_failsafe = said.reasons, said.failsafe

    def on_beat(self) -> None:
        """Ask, answer and keep the autopilot in our mode, 50 times a second, once all nodes are ready."""
        if self.phase in OVER or self.handshake.missing():
            return
        interface = self.interface
        now = self.clock()
        self._note_pause(now)
        interface.take()
        if self.sequence.phase == Phase.STREAM and interface.missing():
            return
        wish = self._wish()
        inputs = arming.Inputs(
            now,
            1e-6 * self.stamps().now,
            interface.autopilot,
            interface.ack,
            max(now - self._unanswered_at, 0.0),
            now - self.heard,
            self._refusal() if self.sequence.phase == Phase.STREAM else self._waits_for(wish),
            self.stop,
            now - interface.spoke_at,
            wish,
            self.commander.is_over,
            self.sequence.phase == Phase.STREAM and bool(self._moves()),
        )
        output, self.sequence = arming.step(self.profile, self.settings.arming, self.sequence, inputs)
        self._tell(now)
        self._report_reasons()
        interface.ack = None
        if output.request is not None:
            self._ask(output.request)
        if output.heartbeat:
            interface.send_heartbeat()
        if output.setpoint in (Setpoint.IDLE, Setpoint.LEVEL) and self.state is not None:
            newtons = self.vehicle.mass * self.vehicle.gravity if output.setpoint == Setpoint.LEVEL else 0.0
            interface.send_safe(output.setpoint, newtons, self.state)
        if output.phase in (Phase.LANDED, Phase.RELEASED):
            self._end(output.reason, now)

    def _end(self, reason: str, now: float) -> None:
        """End the flight of a sequence that is over, once the commander has taken note of it."""
        if self.phase == FlightState.FLYING:
            if not self.commander.is_over and now - self.sequence.since < _COMMANDER_ENDS:
                return  # it takes note of what has become of the vehicle
            is_seen = self.commander.is_over or self.sequence.phase == Phase.RELEASED
            unseen = "" if is_seen else f"{self.profile.name} disarmed before the mission had ended"
            cause = "" if self.cause in reason else self.cause
            reason = "; ".join(dict.fromkeys(filter(None, (reason, self.commander.outcome, cause, unseen))))
        super().end(FlightState.FAILED if reason else FlightState.ENDED, reason)

    def _note_pause(self, now: float) -> None:
        """Blame no other node for a pause of this process: the states that came meanwhile are still to be read."""
        paused, self._beat_at = now - self._beat_at - BEAT, now
        self.note_pause(paused)
        if self.stood_still:
            self.heard = min(self.heard + paused, now)
            self._unanswered_at += min(paused, max(now - self._unanswered_at, 0.0))

    def on_command(self) -> None:
        """Note that a command has come: no state waits for one any more."""
        self._unanswered_at = math.inf

    def arming_refusal(self) -> str:
        """Return why the vehicle must not be armed in our mode now; empty where it may, or flies."""
        phase = self.sequence.phase
        if phase in (Phase.STANDBY, Phase.LANDED, Phase.RELEASED):
            return f"the flight does not arm: {phase.name.lower()}"
        if missing := self.handshake.missing():
            return f"not ready: {', '.join(missing)}"
        if phase not in (Phase.STREAM, Phase.MODE):
            return ""
        return self._refusal() or self._moves()

    def _moves(self) -> str:
        """Return how the estimate moves while the vehicle stands; empty if it rests."""
        return self._standing.refusal(self.settings.arming.speed, self.profile.state)

    def _waits_for(self, wish: Wish) -> str:
        """Return what the commander still waits for while it is arming."""
        return self.commander.answer_text if wish == Wish.IDLE else ""

    def _refusal(self) -> str:
        """Return why the flight must not begin."""
        periods = {stage.role: self.handshake.period(stage.role) for stage in STAGES if stage.role in self.roles}
        misfit = odometry.misfit(self.flight.plant_period, periods, self._spacings, self.profile.state)
        return self.interface.refusal() or misfit

    def _ask(self, request: Request) -> None:
        text = f"{COMMANDS[request.command]}, attempt {request.attempt + 1}"
        self.event(FlightEvent.INFO, f"{self.profile.name.lower()}_command", text, self.elapsed_ns, always=True)
        self.interface.send_request(request)

    def end(self, phase: int, reason: str) -> None:
        """End the flight; a vehicle in the air is landed first."""
        if self.sequence.phase in _ALOFT:
            self.stop = self.stop or reason
        else:
            super().end(phase, reason)

    def on_interrupt(self, name: str) -> None:
        """Have the autopilot land; the bridge cannot stay to see it."""
        flown = self.sequence.phase in _ALOFT and self.is_obeyed()  # a pilot who has it keeps it
        for attempt in range(_LAST_WORDS if flown else 0):
            self._ask(Request(NAV_LAND, attempt=attempt))
            time.sleep(BEAT)
        self.sequence = self.sequence._replace(phase=Phase.RELEASED)
        asked = f"; {self.profile.name} was asked to land" if flown else ""
        super().end(FlightState.FAILED, f"{self.role} stopped by {name}{asked}")
        self.exit_code = 1

    def measurements(self) -> dict[str, float]:
        """Return diagnostics: the base's, the interface's, and where the autopilot stands."""
        found = {**super().measurements(), "autopilot_phase": int(self.sequence.phase), **self.interface.measurements()}
        found["actuation_predicted"] = int(self.interface.is_predicting)
        return found

    def close(self) -> None:
        """Close the autopilot's link."""
        self.interface.close()

"""One step of the commander without ROS: observe, ask, decide, refer, say, in the order of the package's docstring.

core = CommanderCore(parameters, mission, state)          # at the first state
said = core.step(observed, [(request, sender), ...])         # at each of its steps
"""

from collections.abc import Iterable
from typing import NamedTuple

from quad_commander import missions, modes, references
from quad_commander.arming import outside
from quad_commander.missions import Item, Kind, MissionMemory
from quad_commander.mode_table import Condition, Mode, Request
from quad_commander.mode_texts import reason_text, refusal_text
from quad_commander.parameters import CommanderParameters
from quad_commander.request_queue import PendingRequest, RequestQueue
from quad_core.geometry import norm, subtract
from quad_core.types import NOT_BEGUN, FlightMode, GuardStatus, TrajectoryPoint, VehicleState

MISSION_SENDER = "mission"
_ON_GROUND = (Mode.DISARMED, Mode.ARMING)
_UNSURE_GROUND = 5.0  # m; an autopilot's estimate moves in flight, and a landing goes on until it has met the ground
_KILLED_FOR = 10.0  # s after which a killed flight is over, wherever the vehicle is


class AutopilotSeen(NamedTuple):
    """What the autopilot that owns the vehicle said last; ``jumped``: its estimate was reset since the last step."""

    flies: bool = False
    pilot: bool = False
    landed: bool = False
    position_lost: bool = False
    jumped: bool = False


class Inputs(NamedTuple):
    """What the node saw at one of its steps.

    ``mission``: newest point of the mission's trajectory, ``mission_lag`` s before this step (in real time at least the
    time since it arrived); None before the first. ``guard``: what the guard last did. Ages in s. ``refusals``: reasons
    against arming if they were looked for at this step. ``battery``: share of full, 1 if unknown. ``recorder_lost``:
    the recorder has left. ``estimator_reset``: the estimate jumped since the last step. ``end_asked``: why the flight
    shall end, empty if it shall not. ``autopilot``: None without one; it then says itself what jumped.
    """

    step: int
    dt: float
    state: VehicleState
    mission: TrajectoryPoint | None
    mission_lag: float
    setpoint_age: float = 0.0
    state_age: float = 0.0
    overruns: float = 0.0
    guard: GuardStatus = GuardStatus()
    battery: float = 1.0
    refusals: list[str] | None = None
    recorder_lost: bool = False
    estimator_reset: bool = False
    end_asked: str = ""
    autopilot: AutopilotSeen | None = None


class Outputs(NamedTuple):
    """What is published of one step: mode and reference from the one decision, the texts, and ``news`` for the record.

    ``news`` are (kind, text) of what changed at this step.
    """

    mode: FlightMode
    reference: TrajectoryPoint
    text: str
    sender: str
    answer_text: str
    outcome: str
    news: list[tuple[str, str]]


class CommanderCore:
    """What the commander remembers between two steps."""

    def __init__(
        self,
        parameters: CommanderParameters,
        mission: tuple[Item, ...],
        state: VehicleState,
        requests: RequestQueue | None = None,
    ) -> None:
        """Start disarmed; the reference stands at ``state``. ``requests``: what was asked for already."""
        self._parameters = parameters
        self._memory, self._mission, self._item = modes.init(), mission, MissionMemory()
        self._requests = requests if requests is not None else RequestQueue()
        self._sent = references.standing(state)
        self._plan = references.plan_mode(parameters.references, Mode.DISARMED, self._sent, 0.0, 0.0)
        self._time = self._kept_waiting = self._unbegun = self._in_mode = 0.0
        self._hand_over: references.ReferencePlan | None = None
        self._aside: tuple[references.ReferencePlan, float] | None = None
        self._handed = 0.0
        self._said = FlightMode()
        self._last = PendingRequest(Request.NONE, "")
        self._text = self._answer_text = self._cut = ""
        self._refusals: list[str] | None = None
        self._went_along = False
        self._flown = self._gave_up = self._cut_by_end = False

    @property
    def mode(self) -> Mode:
        """The mode of the last decision."""
        return Mode(self._memory.mode)

    def foresee(self, request: Request) -> str:
        """Return why ``request`` would be refused now, empty if it would not."""
        answer, blocked_by = modes.asked(self._memory.mode, request, self._said.raised)
        return refusal_text(self._memory.mode, request, blocked_by) if answer == modes.NOT_DONE else ""

    def step(self, seen: Inputs, asked: Iterable[PendingRequest] = ()) -> Outputs:
        """Return what is said at one step."""
        for one in asked:
            self._requests.add(one)
        if seen.refusals is not None:
            self._refusals = seen.refusals
        request = self._next_request(seen)
        before = self._memory
        decision, self._memory = modes.step(
            self._parameters.modes,
            before,
            self._health(seen),
            Request.NONE if request.overtaken else request.request,
            seen.dt,
        )
        if request.overtaken:
            decision = decision._replace(answer=modes.NOT_DONE)
        elif decision.answer == modes.DONE and request.sender != MISSION_SENDER:
            self._requests.grant(request)
        if decision.changed and decision.reason != modes.ON_REQUEST and decision.mode > before.mode:
            self._requests.overtake(Mode(decision.mode))
        news = self._note(seen, request, decision, before)
        reference = self._refer(seen, decision, Mode(before.mode))
        self._sent = reference
        over = self._is_over(seen)
        return Outputs(
            self._said._replace(is_over=over),
            reference,
            self._text,
            self._last.sender,
            self._answer_text or self._waits_for(),
            self._outcome(seen) if over else "",
            news,
        )

    def _health(self, seen: Inputs) -> modes.Health:
        parameters, mode, autopilot = self._parameters, self._memory.mode, seen.autopilot or AutopilotSeen()
        ended = self._hand_over is not None and seen.mission is not None and _rests(seen.mission)
        waits = mode == Mode.MISSION and self._hand_over is None
        self._unbegun = self._unbegun + seen.dt if waits else 0.0
        lag = seen.mission_lag if seen.mission is not None else self._in_mode
        return modes.Health(
            reference_age=max(lag, self._unbegun),
            setpoint_age=seen.setpoint_age,
            state_age=seen.state_age,
            guard_mode=seen.guard.mode,
            guard_condition=seen.guard.condition,
            guard_land=seen.guard.land,
            contact=seen.guard.contact or seen.guard.stopped or autopilot.landed,
            position_error=0.0
            if mode in _ON_GROUND or mode >= Mode.DESCEND
            else norm(subtract(seen.state.p_w, self._sent.p_w)),
            battery=seen.battery,
            outside_fence=outside(parameters.fence, seen.state.p_w, seen.state.ground_z),
            position_good=not autopilot.position_lost,
            pilot=autopilot.pilot,
            overruns=seen.overruns,
            recorder_lost=seen.recorder_lost,
            estimator_reset=autopilot.jumped or (seen.autopilot is None and seen.estimator_reset),
            end_asked=bool(seen.end_asked),
            checks_passed=self._refusals == [],
            plan_ended=mode == Mode.MISSION and ended,
            reference_done=self._time >= self._plan.duration and not autopilot.flies,
            done_time=max(self._time - self._plan.duration, 0.0),
        )

    def _next_request(self, seen: Inputs) -> PendingRequest:
        """Return the operator's next request, else the mission's."""
        request, self._item = missions.next_request(
            self._mission, self._item, self._memory.mode, self._memory.reason, seen.dt
        )
        asked_for = self._memory.reason == modes.ON_REQUEST  # an operator may hold as long as they like
        waits = missions.is_kept_waiting(self._mission, self._item, self._memory.mode) and not request and not asked_for
        self._kept_waiting = self._kept_waiting + seen.dt if waits else 0.0
        waiting = self._requests.take(self._memory.mode, seen.dt)
        if waiting is not None:
            return waiting
        if self._kept_waiting > self._parameters.wait_limit:
            waited = f"kept waiting for {self._parameters.wait_limit:g} s"
            return PendingRequest(Request.LAND, f"{MISSION_SENDER}, {waited} ({self._text})")
        on_ground = self._memory.mode in _ON_GROUND
        if on_ground and (self._flown or self._gave_up or seen.end_asked):
            return PendingRequest(Request.NONE, "")
        return PendingRequest(request, MISSION_SENDER)

    def _note(
        self, seen: Inputs, asked: PendingRequest, decision: modes.Decision, before: modes.Memory
    ) -> list[tuple[str, str]]:
        """Take down mode, request and answer; return what is new about them."""
        news, said = [], self._said
        refusal = ""
        if decision.answer == modes.NOT_DONE:
            refusal = refusal_text(before.mode, asked.request, decision.blocked_by)
        if asked.overtaken:
            refusal = f"{asked.request.name} was asked for before {asked.overtaken} began"
        again = asked == self._last and refusal == self._answer_text and asked.sender == MISSION_SENDER
        if decision.answer != modes.NOT_ASKED and not again:
            self._last, self._answer_text = asked, refusal
            said = said._replace(request=int(asked.request), answer=decision.answer, request_step=seen.step)
            answer = f"refused: {refusal}" if refusal else "done"
            news.append(("request", f"{asked.request.name} of {asked.sender}: {answer}"))
        if decision.changed:
            mode = Mode(decision.mode)
            self._text = reason_text(
                self._parameters.modes, mode, decision.reason, self._last.sender, seen.guard.reason
            )
            if mode == Mode.DISARMED and before.mode == Mode.ARMING:
                self._gave_up = True
                self._text += "".join(f"; {reason}" for reason in self._refusals or [])
            news.append(("mode", f"{Mode(before.mode).name} to {mode.name}: {self._text}"))
            said = said._replace(since=seen.step)
            self._flown = self._flown or mode >= Mode.TAKEOFF
            if mode < Mode.LAND and mode not in _ON_GROUND:
                self._cut = ""
            elif mode >= Mode.LAND and not self._cut:
                self._cut_by_end = decision.reason == Condition.END_ASKED
                self._cut = f"{mode.name} at step {seen.step}: {self._text}"
            if mode == Mode.ARMING:
                self._refusals = None
        self._in_mode = 0.0 if decision.changed else self._in_mode + seen.dt
        self._said = said._replace(
            mode=decision.mode, reason=decision.reason, raised=decision.raised, guard_request=decision.guard_request
        )
        return news

    def _refer(self, seen: Inputs, decision: modes.Decision, before: Mode) -> TrajectoryPoint:
        """Return the reference of the mode that was decided."""
        limits, mode = self._parameters.references, Mode(decision.mode)
        current = references.continued(self._sent, seen.dt)
        if decision.changed and (mode in _ON_GROUND or before in _ON_GROUND):
            current = references.standing(seen.state)
        goes_along = mode >= Mode.DESCEND or (seen.autopilot is not None and (seen.autopilot.flies or self._went_along))
        jumped = seen.autopilot is not None and seen.autopilot.jumped
        self._went_along = mode not in _ON_GROUND and seen.autopilot is not None and seen.autopilot.flies
        if mode not in _ON_GROUND and (before >= Mode.DESCEND or goes_along or jumped):
            current = references.from_state(seen.state)  # something else flies it, or its estimate was reset
        if decision.changed or (mode not in _ON_GROUND and (goes_along or (jumped and mode != Mode.MISSION))):
            lowest = _UNSURE_GROUND if seen.autopilot is not None and mode == Mode.LAND else 0.0
            ground = seen.state.ground_z - lowest
            self._plan = references.plan_mode(limits, mode, current, ground, self._takeoff_height())
            self._time, self._hand_over, self._aside = 0.0, None, None
        else:
            self._time += seen.dt
        if mode == Mode.TAKEOFF:
            return self._rise(seen.state)
        if mode != Mode.MISSION or seen.mission is None or _rests(seen.mission):
            point = references.sample(self._plan, self._time)
            sideways = self._time < max(self._plan.x.duration, self._plan.y.duration)
            on_ground = mode == Mode.LAND and seen.guard.on_ground
            return references.above(point, seen.state) if on_ground and not sideways else point
        point = references.continued(seen.mission, seen.mission_lag)
        if self._hand_over is None:
            self._hand_over, self._handed = references.plan_hand_over(limits, current, point), 0.0
        else:
            self._handed += seen.dt
        return references.handed_over(self._hand_over, self._handed, point)

    def _rise(self, state: VehicleState) -> TrajectoryPoint:
        """Return the reference of TAKEOFF: straight up, over where the air takes the vehicle until it may tilt."""
        if state.on_ground or self._aside is None:
            limits = self._parameters.references
            stop = references.plan_mode(limits, Mode.HOLD, references.from_state(state), 0.0, 0.0)
            self._aside = stop, self._time
        stop, since = self._aside
        point, beside = references.sample(self._plan, self._time), references.sample(stop, self._time - since)
        return references.beside(point, beside)

    def _takeoff_height(self) -> float:
        return next(
            (item.value for item in self._mission if item.kind == Kind.TAKEOFF), self._parameters.takeoff_height
        )

    def _waits_for(self) -> str:
        return "; ".join(self._refusals or []) if self._memory.mode == Mode.ARMING else ""

    def _is_over(self, seen: Inputs) -> bool:
        if self._memory.mode == Mode.KILL:
            return self._in_mode >= _KILLED_FOR or seen.guard.contact
        done = self._flown and bool(self._mission)
        return self._memory.mode == Mode.DISARMED and (
            done or bool(seen.end_asked) or (self._gave_up and self._mission != ())
        )

    def _outcome(self, seen: Inputs) -> str:
        """Return why the mission was not flown to its end; empty if it was, or without a mission if nothing failed."""
        if seen.end_asked and (not self._flown or self._cut_by_end):
            return f"landed: {seen.end_asked}" if self._flown else seen.end_asked
        if self._memory.mode == Mode.KILL or not self._flown:
            return self._cut or f"not armed: {self._text}"
        last = bool(self._mission) and self._item.item >= len(self._mission) - 1 and self._item.began
        return "" if last else f"mission not finished: {self._cut}"


def _rests(point: TrajectoryPoint) -> bool:
    """Return whether a mission's trajectory has not begun, or has ended."""
    return point.trajectory_time <= NOT_BEGUN

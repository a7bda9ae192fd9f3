"""One step of the commander without ROS: observe, ask, decide, refer, say, in this order.

core = CommanderCore(parameters, mission, state, requests)  # at the first state; requests wait in that queue
said = core.step(inputs)  # at each of its steps
"""

from collections.abc import Iterable
from typing import NamedTuple

from quad_commander import missions, modes
from quad_commander.missions import Item, MissionMemory
from quad_commander.mode_reference import ModeReference, rests
from quad_commander.mode_table import BY_REFERENCE, GRANTED, Condition, severity
from quad_commander.modes import Inputs
from quad_commander.parameters import CommanderParameters
from quad_commander.references import Place
from quad_commander.request_queue import REPEATS_WITHIN, PendingRequest, RequestQueue
from quad_core.enumerations import ON_GROUND, Answer, Mode, Request
from quad_core.geometry import norm, subtract
from quad_core.types import FlightMode, TrajectoryPoint, Vec3, VehicleState

MISSION_SENDER = "mission"
REQUEST_REFUSED, MISSION_REFUSED = "request_refused", "mission_refused"
"""Kinds of news that an operator must see."""
_KILLED_FOR = 10.0  # s after which a killed flight is over, wherever the vehicle is


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
        self._memory, self._mission, self._item = modes.Memory(), mission, MissionMemory()
        self._requests = requests if requests is not None else RequestQueue()
        height = mission[0].value if mission else 0.0  # its first item is the take-off
        self._reference = ModeReference(parameters.references, height or parameters.takeoff_height, state)
        self._unbegun = self._refused_for = 0.0
        self._said = FlightMode()
        self._last = PendingRequest(Request.NONE, "")
        self._text = self._answer_text = self._why_down = ""
        self._down_for = modes.NO_REASON
        self._refusals: list[str] | None = None
        self._seen = Inputs(state=state)
        self._flown = self._gave_up = self._refused_other = False

    @property
    def mode(self) -> Mode:
        """The mode of the last decision."""
        return self._memory.mode

    def foresee(self, asked: PendingRequest) -> str:
        """Return why ``asked`` would be refused now, empty if it would not."""
        request = asked.request
        raised = frozenset(condition for condition in Condition if self._said.raised >> condition & 1)
        on_ground = self._seen.state.on_ground
        answer, blocked_by = modes.asked(self.mode, request, raised, on_ground)
        if answer == Answer.REFUSED:
            return modes.refusal_text(self.mode, request, blocked_by)
        for first in self._requests.ahead_of(request):
            if modes.asked(self.mode, first.request, raised, on_ground)[0] == Answer.DONE:
                return f"{request.name} is not possible: {first.request.name} of {first.sender} comes first"
        if self._requests.only_repeats(asked, self.mode):
            return f"{request.name} is not possible: granted less than {REPEATS_WITHIN:g} s ago; ask again then"
        return self._unfit(asked)

    def step(self, seen: Inputs, asked: Iterable[PendingRequest] = ()) -> Outputs:
        """Return what is said at one step."""
        self._seen = seen
        for one in asked:
            self._requests.add(one)
        if seen.refusals is not None:
            self._refusals = seen.refusals + [
                f"mission: found {refusal}"
                for item in self._mission
                if item.place and (refusal := self._unreachable(item.place, seen.state))
            ]
        before, request = self._memory, self._next_request(seen)
        refusal = f"{request.request.name} was asked for before {request.overtaken} began" if request.overtaken else ""
        refusal = refusal or self._unfit(request)
        decision, self._memory = modes.step(
            self._parameters.modes, before, self._observed(seen), Request.NONE if refusal else request.request, seen.dt
        )
        if refusal:
            decision = decision._replace(answer=Answer.REFUSED)
        elif decision.answer == Answer.REFUSED:
            refusal = modes.refusal_text(decision.mode, request.request, decision.blocked_by)
        elif decision.answer == Answer.DONE:
            self._requests.grant(request, decision.mode)
        self._refused_other = decision.answer == Answer.REFUSED and request.sender != MISSION_SENDER
        if decision.changed and decision.reason != modes.ON_REQUEST and severity(decision.mode) > severity(before.mode):
            self._requests.begin(decision.mode)
        news = self._note(seen, request, refusal, decision, before)
        is_granted = decision.answer == Answer.DONE
        reference = self._reference.step(seen, before.mode, decision.mode, request.place, is_granted)
        over = self._is_over(seen)
        waits_for = "; ".join(self._refusals or []) if self.mode == Mode.ARMING else ""
        return Outputs(
            self._said._replace(is_over=over),
            reference,
            self._text,
            self._last.sender,
            self._answer_text or waits_for,
            self._outcome(seen) if over else "",
            news,
        )

    def _unreachable(self, place: Place, state: VehicleState) -> str:
        """Return why the vehicle must not be sent to ``place``, empty if it may."""
        if place.z <= state.ground_z:
            return f"goto {place}, at most the height of the ground, expected a place in the air; land lands"
        fence = self._parameters.fence
        if fence.excludes(Vec3(place.x, place.y, place.z), state.ground_z):
            corners = (" ".join(f"{part:g}" for part in corner) for corner in fence)
            return f"goto {place}, outside the fence, expected a place within {' to '.join(corners)} m above the ground"
        return ""

    def _unfit(self, asked: PendingRequest) -> str:
        """Return why what the mode would allow is refused now, empty if it is not."""
        if asked.place and self.mode in GRANTED[Request.GOTO]:
            return self._unreachable(asked.place, self._seen.state)
        late = self._seen.mission is not None and self._seen.mission_lag > self._parameters.modes.reference_late
        # the mission itself asks all the same, and then holds and lands for the lost reference
        if late and asked.request == Request.MISSION and self.mode == Mode.HOLD and asked.sender != MISSION_SENDER:
            return modes.refusal_text(self.mode, asked.request, Condition.REFERENCE_LATE)
        return self._unready(asked.request)

    def _unready(self, request: Request) -> str:
        """Return why an autopilot must not be armed yet: one that then waits for the take-off disarms by itself."""
        if not self._seen.by_autopilot or self.mode != Mode.DISARMED or request not in (Request.ARM, Request.TAKEOFF):
            return ""
        return "the checks before arming have not run yet" if self._is_unseen else "; ".join(self._refusals or [])

    @property
    def _is_unseen(self) -> bool:
        """Whether the checks before an autopilot is armed have not run yet."""
        return self._seen.by_autopilot and self.mode == Mode.DISARMED and self._refusals is None

    def _observed(self, seen: Inputs) -> Inputs:
        """Return ``seen`` with what the commander itself knows."""
        mode, fence = self.mode, self._parameters.fence
        reference = self._reference
        ended = reference.is_handed_over and seen.mission is not None and rests(seen.mission)
        waits = mode == Mode.MISSION and not reference.is_handed_over
        self._unbegun = self._unbegun + seen.dt if waits else 0.0
        lag = seen.mission_lag if seen.mission is not None else self._memory.time
        # in the step in which the estimate jumps the reference has not gone along yet
        followed = mode in BY_REFERENCE and not (seen.by_autopilot and seen.estimator_reset)
        return seen._replace(
            reference_age=max(lag, self._unbegun),
            position_error=norm(subtract(seen.state.p_w, reference.point.p_w)) if followed else 0.0,
            outside_fence=fence.excludes(seen.state.p_w, seen.state.ground_z),
            checks_passed=self._refusals == [],
            plan_ended=mode == Mode.MISSION and ended,
            reference_done=reference.arrived and not seen.autopilot_flies,
            done_time=reference.rest_time,
        )

    def _next_request(self, seen: Inputs) -> PendingRequest:
        """Return the operator's next request, else the mission's.

        After a refused one the mission's comes first, unless a more severe one waits: no stream keeps it waiting.
        """
        own = self._mission_request(seen)
        self._requests.age(seen.dt)
        if self._refused_other and own.request and not self._requests.ahead_of(own.request):
            return own
        return self._requests.take(self.mode) or own

    def _mission_request(self, seen: Inputs) -> PendingRequest:
        request, self._item = missions.next_request(
            self._mission,
            self._item,
            self.mode,
            self._memory.reason,
            seen.dt,
            self._reference.place,
            self._reference.arrived,
        )
        if self._item.waited > self._parameters.wait_limit:
            waited = f"kept waiting for {self._parameters.wait_limit:g} s"
            return PendingRequest(Request.LAND, f"{MISSION_SENDER}, {waited} ({self._text})")
        stays = self._flown or self._gave_up or seen.end_asked or self._is_unseen
        if not request or (self.mode in ON_GROUND and stays):
            return PendingRequest(Request.NONE, "")
        return PendingRequest(request, MISSION_SENDER, place=self._mission[self._item.item].place)

    def _note(
        self, seen: Inputs, asked: PendingRequest, refusal: str, decision: modes.Decision, before: modes.Memory
    ) -> list[tuple[str, str]]:
        """Take down mode, request and answer; return what is new about them."""
        news, said, mode = [], self._said, decision.mode
        refused = mode == Mode.DISARMED and decision.answer == Answer.REFUSED and asked.sender == MISSION_SENDER
        if asked.sender == MISSION_SENDER or not asked.request:
            self._refused_for = self._refused_for + seen.dt if refused else 0.0
        if self._refused_for > self._parameters.modes.arming_late:
            self._gave_up, self._text = True, refusal
        again = asked == self._last and refusal == self._answer_text and asked.sender == MISSION_SENDER
        if decision.answer != Answer.NOT_ASKED and not again:
            self._last, self._answer_text = asked, refusal
            said = said._replace(request=int(asked.request), answer=decision.answer, request_step=seen.step)
            kind = "request" if not refusal else MISSION_REFUSED if asked.sender == MISSION_SENDER else REQUEST_REFUSED
            answer = f"refused: {refusal}" if refusal else "done"
            news.append((kind, f"{asked.request.name} of {asked.sender}: {answer}"))
        if decision.changed or (decision.answer == Answer.DONE and mode == Mode.HOLD):
            limits, asker = self._parameters.modes, self._last.sender
            self._text = modes.reason_text(limits, mode, decision.reason, asker, seen.guard.reason)
            if decision.reason == Condition.END_ASKED:
                self._text = seen.end_asked or self._text
        if decision.changed:
            if mode == Mode.DISARMED and before.mode == Mode.ARMING:
                self._gave_up = True
                self._text += "".join(f"; {reason}" for reason in self._refusals or [])
            if mode == Mode.LAND and before.mode in (*ON_GROUND, Mode.TAKEOFF) and seen.state.on_ground:
                self._text += "; not clear of the ground"
            news.append(("mode", f"{before.mode.name} to {mode.name}: {self._text}"))
            said = said._replace(since=seen.step)
            self._flown = self._flown or mode not in ON_GROUND
            comes_down = severity(mode) >= severity(Mode.LAND)
            if not comes_down and mode not in ON_GROUND:
                self._why_down = ""
            elif comes_down and not self._why_down:
                self._down_for = decision.reason
                self._why_down = f"{mode.name} at step {seen.step}: {self._text}"
            if mode == Mode.ARMING:
                self._refusals = None
        raised = sum(1 << condition for condition in decision.raised)
        self._said = said._replace(
            mode=int(mode), reason=int(decision.reason), raised=raised, guard_request=decision.guard_request
        )
        return news

    def _is_over(self, seen: Inputs) -> bool:
        if self.mode == Mode.KILL:
            return self._memory.time >= _KILLED_FOR or seen.guard.contact
        done = self._flown and bool(self._mission)
        return self.mode == Mode.DISARMED and (done or bool(seen.end_asked) or (self._gave_up and self._mission != ()))

    def _outcome(self, seen: Inputs) -> str:
        """Return why the mission was not flown to its end, empty if it was.

        Without a mission: why the vehicle came down, empty if an operator asked for that.
        """
        if seen.end_asked and (not self._flown or self._down_for == Condition.END_ASKED):
            return f"landed: {seen.end_asked}" if self._flown else seen.end_asked
        if self.mode == Mode.KILL or not self._flown:
            return self._why_down or f"not armed: {self._text}"
        if not self._mission:
            return "" if self._down_for == modes.ON_REQUEST else self._why_down
        last = self._item.item >= len(self._mission) - 1 and self._item.began
        return "" if last else f"mission not finished: {self._why_down}"

"""The guard of ``quad_guard.guard`` in a vehicle interface: stepped, reported as ``flight/guard`` and as events."""

from collections.abc import Callable
from typing import NamedTuple

from quad_core.cascade import COMMAND
from quad_core.cycle import seconds
from quad_core.guard_parameters import GuardParameters
from quad_core.types import Wrench
from quad_guard import guard
from quad_guard.checks import ACCEPTED, COMMAND_REFUSALS, FROZEN, STATE_REFUSALS, StateSample, WrenchCommand
from quad_guard.guard import ASK_DESCEND, KILL, MODES, NO_REQUEST, PASS, REASONS, STATE_LOST, WRENCH_LOST, Report
from quad_msgs.msg import FlightEvent, GuardStatus
from quad_node.conversion import set_stamp
from quad_node.flight_node import FlightNode

_SECOND = 1_000_000_000  # ns
_HEARD = 0.04  # s since a wrench of any quality arrived: shorter than the guard's patience
_RESTING = Report(PASS, guard.GOOD, 0, guard.GOOD, 0.0, 0.0, 0, 0, 0, 0, False, False, False, False, False)
_STATUS_PERIOD = 100_000_000  # ns between two messages on flight/guard while nothing changes


class Command(NamedTuple):
    """The newest wrench: of which plant step it is, and when it arrived (steady s)."""

    step: int
    wrench: Wrench
    arrived: float


class VehicleGuard:
    """Holds the guard's memory between plant steps; ``report`` is that of the last step, None before the first."""

    def __init__(self, node: FlightNode, parameters: GuardParameters, period_of: Callable[[], int]) -> None:
        """Make the guard of ``node`` and its publisher; ``period_of`` gives the commander's period in steps, 0: none.

        The step before each of its decisions is reported: in lockstep it waits for that.
        """
        self.parameters = parameters
        self.memory = guard.init(parameters, node.vehicle)
        self.report: Report | None = None
        self.last_refusal = ""
        self._node = node
        self._period = node.flight.plant_period
        self._dt = seconds(1, self._period)
        self._dropped = 0
        self._said = (PASS, guard.GOOD, False)
        self._reported: dict[str, int] = {}
        self._due, self._period_of = 0, period_of
        self._status_out = node.publisher("flight/guard", match=False)

    @property
    def taken_over(self) -> bool:
        """Whether the controller's wrench no longer reaches the rotors."""
        return self.memory.mode != PASS

    def rest(self, step: int) -> None:
        """Let ``step`` pass without a look at it: ages count from the next one, no mode is latched."""
        self.memory = guard.init(self.parameters, self._node.vehicle)
        self._tell(step, _RESTING)

    def step(self, step: int, command: WrenchCommand, sample: StateSample, request: int) -> Wrench:
        """Return the wrench for the rotors over plant step ``step``."""
        if not self.parameters.enabled:
            return command.wrench
        inputs = guard.Inputs(step, self._period, command, sample, request)
        flown, self.memory, report = guard.step(self.parameters, self._node.vehicle, self.memory, inputs, self._dt)
        self.report = report
        self._tell(step, report)
        return flown

    def refused(self, step: int, refusal: int) -> None:
        """Count and report a wrench that was refused when it arrived, so that it hid no good one."""
        self._dropped += 1
        self._tell_refusal(step, f"{COMMAND}: {COMMAND_REFUSALS[refusal]}")

    def describe(self) -> str:
        """Return since when and why the guard flies, for people; empty if it does not."""
        memory = self.memory
        if memory.mode == PASS:
            return ""
        reason = REASONS[memory.reason]
        topic = {WRENCH_LOST: f"{COMMAND}:", STATE_LOST: "state:"}.get(memory.reason)
        if topic and self.last_refusal.startswith(topic):
            reason += f", the last one was refused: {self.last_refusal}"
        return f"guard in {MODES[memory.mode]} since step {memory.since}: {reason}"

    def _tell(self, step: int, report: Report) -> None:
        """Publish what changed, and ten times a second what is."""
        # a sensor slower than the plant repeats itself rightly
        is_slow = report.state_refusal == FROZEN and report.state_age <= self.parameters.state.warn_age
        if report.state_refusal != ACCEPTED and not is_slow:
            self._tell_refusal(step, f"state: {STATE_REFUSALS[report.state_refusal]}")
        if report.command_refusal != ACCEPTED:
            self._tell_refusal(step, f"{COMMAND}: {COMMAND_REFUSALS[report.command_refusal]}")
        found = (report.mode, report.reason, bool(self.last_refusal))
        if found[:2] != self._said[:2]:
            self._tell_mode(step, report)
        commanders = self._period_of()
        if found == self._said and step < self._due and not (commanders and (step + 1) % commanders == 0):
            return
        self._said = found
        self._due = step + max(1, _STATUS_PERIOD // self._period)
        self._publish(step, report)

    def _tell_refusal(self, step: int, text: str) -> None:
        """Report a refusal, the same one at most once a second: two that take turns must not flood the log."""
        self.last_refusal = text
        if step < self._reported.get(text, 0):
            self._node.counters["guard_refused"] += 1
            return
        self._reported[text] = step + _SECOND // self._period
        stamp = step * self._period
        self._node.event(FlightEvent.WARNING, "guard_refused", f"step {step}: {text}; dropped", stamp, always=True)

    def _tell_mode(self, step: int, report: Report) -> None:
        stamp, reason = step * self._period, REASONS[report.reason]
        if report.mode == KILL:
            self._node.event(FlightEvent.ERROR, "guard_killed", f"step {step}: {reason}; motors off", stamp)
        elif report.mode == PASS:
            text = f"step {step}: the controller flies again"
            self._node.event(FlightEvent.WARNING, "guard_released", text, stamp, always=True)
        else:
            ages = f"wrench {report.command_age:.3f} s, state {report.state_age:.3f} s old"
            text = f"step {step}: {reason} ({ages}); the backup law descends"
            self._node.event(FlightEvent.WARNING, "guard_descends", text, stamp, always=True)

    def _publish(self, step: int, report: Report) -> None:
        message = GuardStatus(
            step=step,
            since=report.since,
            refused_commands=report.refused_commands + self._dropped,
            refused_samples=report.refused_samples,
            command_age=report.command_age,
            state_age=report.state_age,
            mode=report.mode,
            reason=report.reason,
            condition=report.condition,
            warning=report.warning,
            land=report.land,
            stopped=report.stopped,
            on_ground=report.on_ground,
            contact=report.contact,
            reason_text=REASONS[report.reason],
            refusal=self.last_refusal,
            run_id=self._node.flight.run_id,
        )
        set_stamp(message.stamp, step * self._period)
        self._status_out.publish(message)


def culprit(reason: int, quiet: float, stood_still: str, missing: str, estimator: str) -> str:
    """Return who or what made the guard take over for ``reason``, empty if it was the flight itself.

    ``quiet``: s since a wrench of any quality arrived. ``stood_still``: why the vehicle interface could not hear one,
    empty if it could. ``missing`` names who does not answer, ``estimator`` where the states come from.
    """
    if reason == WRENCH_LOST:
        arrives = f"{COMMAND} arrives, but no good one reaches the rotors" if quiet <= _HEARD else ""
        return stood_still or arrives or missing
    return (stood_still or f"state: nothing good from {estimator}") if reason == STATE_LOST else ""


def severest(asked: int, gives_up: bool) -> int:
    """Return the request that the guard gets: what was asked for, or DESCEND where the flight was given up."""
    return max(asked, ASK_DESCEND if gives_up else NO_REQUEST)

"""The guard before the rotors of a vehicle: it lets a wrench through or flies its own, and says which."""

from collections.abc import Callable

from quad_core.cascade import COMMAND
from quad_core.cycle import seconds
from quad_core.enumerations import CommandRefusal, GuardMode, GuardReason, StateRefusal
from quad_core.node_parameters import GuardParameters
from quad_core.types import GuardStatus, Wrench
from quad_guard import guard
from quad_guard.checks import COMMAND_REFUSALS, STATE_REFUSALS, StateSample, WrenchCommand
from quad_guard.ending import described
from quad_guard.guard import REASONS
from quad_msgs.msg import GuardStatus as GuardStatusMsg
from quad_node.codec import NANOSECONDS, set_stamp
from quad_node.flight_node import FlightNode

_RESTING = GuardStatus()
_STATUS_PERIOD = 100_000_000  # ns between two messages on flight/guard while nothing changes


class VehicleGuard:
    """Holds the guard's memory between plant steps; ``killed`` says what its KILL does."""

    def __init__(self, node: FlightNode, parameters: GuardParameters, period_of: Callable[[], int]) -> None:
        """Make the guard of ``node`` and its publisher; ``period_of`` gives the commander's period in steps, 0: none.

        The step before each of its decisions is reported: in lockstep it waits for that.
        """
        self.parameters = parameters
        self.memory = guard.FRESH_MEMORY
        self.last_refusal = self.asked_because = ""
        self.killed = "motors off"
        self._node = node
        self._period = node.flight.plant_period
        self._dt = seconds(1, self._period)
        self._dropped, self._refused_step = 0, -1
        self._said: tuple[int, int, bool] = (GuardMode.PASS, GuardReason.GOOD, False)
        self._reported: dict[str, int] = {}
        self._due, self._period_of = 0, period_of
        self._status_out = node.links.publisher("flight/guard", match=False)

    @property
    def taken_over(self) -> bool:
        """Whether the controller's wrench no longer reaches the rotors."""
        return self.memory.mode != GuardMode.PASS

    def rest(self, step: int) -> None:
        """Let ``step`` pass without a look at it: ages count from the next one, no mode is latched."""
        self.memory = guard.FRESH_MEMORY
        self._tell(step, _RESTING)

    def step(self, step: int, command: WrenchCommand, sample: StateSample, request: int) -> Wrench:
        """Return the wrench for the rotors over plant step ``step``."""
        if not self.parameters.enabled:
            return command.wrench
        inputs = guard.Inputs(step, self._period, command, sample, request)
        flown, self.memory, report = guard.step(self.parameters, self._node.vehicle, self.memory, inputs, self._dt)
        # a sensor slower than the plant repeats itself rightly
        is_frozen = report.state_refusal == StateRefusal.FROZEN
        is_slow = is_frozen and report.status.state_age <= self.parameters.state.warn_age
        if report.state_refusal != StateRefusal.ACCEPTED and not is_slow:
            self._tell_refusal(step, f"state: {STATE_REFUSALS[report.state_refusal]}")
        if report.command_refusal != CommandRefusal.ACCEPTED:
            self._tell_refusal(step, f"{COMMAND}: {COMMAND_REFUSALS[report.command_refusal]}")
        self._tell(step, report.status)
        return flown

    def refused(self, step: int, refusal: int) -> None:
        """Count and report a wrench that was refused when it arrived, so that it hid no good one."""
        self._dropped += 1
        self._tell_refusal(step, f"{COMMAND}: {COMMAND_REFUSALS[refusal]}")

    def note_refusal(self, step: int, text: str) -> None:
        """Note what was refused last, at ``step``."""
        self.last_refusal, self._refused_step = text, step

    def describe(self) -> str:
        """Return since when and why the guard flies, for people; empty if it does not."""
        memory = self.memory
        found = described(memory.mode, memory.reason, memory.since)
        lost = {
            GuardReason.WRENCH_LOST: (f"{COMMAND}:", memory.command_step),
            GuardReason.STATE_LOST: ("state:", memory.estimate.step),
        }
        topic, last_good = lost.get(GuardReason(memory.reason), ("", 0))
        if found and topic and self.last_refusal.startswith(topic) and self._refused_step >= last_good:
            found += f", the last one was refused: {self.last_refusal}"
        return found

    def _tell(self, step: int, status: GuardStatus) -> None:
        """Publish what changed, and ten times a second what is."""
        found = (status.mode, status.reason, bool(self.last_refusal))
        if found[:2] != self._said[:2]:
            self._tell_mode(step, status)
        commander_period = self._period_of()
        if found == self._said and step < self._due and not (commander_period and (step + 1) % commander_period == 0):
            return
        self._said = found
        self._due = step + max(1, _STATUS_PERIOD // self._period)
        message = GuardStatusMsg(
            step=step,
            reason_text=REASONS[status.reason],
            refusal=self.last_refusal,
            run=self._node.run,
            **status._replace(refused_commands=status.refused_commands + self._dropped)._asdict(),
        )
        set_stamp(message.stamp, step * self._period)
        self._status_out.publish(message)

    def _tell_refusal(self, step: int, text: str) -> None:
        """Report a refusal, the same one at most once a second: two that take turns must not flood the log."""
        self.note_refusal(step, text)
        if step < self._reported.get(text, 0):
            self._node.events.counts["guard_refused"] += 1
            return
        self._reported[text] = step + NANOSECONDS // self._period
        stamp = step * self._period
        self._node.events.warn("guard_refused", f"step {step}: {text}; dropped", stamp, always=True)

    def _tell_mode(self, step: int, status: GuardStatus) -> None:
        stamp, reason = step * self._period, REASONS[status.reason]
        if status.reason == GuardReason.REQUESTED and self.asked_because:
            reason = self.asked_because
        if status.mode == GuardMode.KILL:
            self._node.events.error("guard_killed", f"step {step}: {reason}; {self.killed}", stamp)
        elif status.mode == GuardMode.PASS:
            text = f"step {step}: {'the guard rests' if status is _RESTING else 'the controller flies again'}"
            self._node.events.warn("guard_released", text, stamp, always=True)
        else:
            ages = f"wrench {status.command_age:.3f} s, state {status.state_age:.3f} s old"
            text = f"step {step}: {reason} ({ages}); the backup law descends"
            self._node.events.warn("guard_descends", text, stamp, always=True)

"""The mode table for people: Markdown tables made from ``mode_table``, for docs/reference/modes.md."""

from quad_commander.mode_table import FAULTS, GRANTED, IN_THE_AIR, MODES, PROGRESS, TABLE
from quad_commander.modes import words
from quad_commander.parameters import ModeParameters
from quad_core.enumerations import Mode


def fault_table() -> str:
    """Return mode x condition as Markdown: a cell names the next mode, or is empty where nothing changes."""
    columns = [Mode.ARMING, *IN_THE_AIR]
    lines = [
        "| what is wrong | " + " | ".join(f"in {mode.name}" for mode in columns) + " |",
        "|---|" + "---|" * len(columns),
    ]
    for fault in FAULTS:
        cells = []
        for mode in columns:
            following = TABLE[mode][fault.condition]
            cells.append("" if following == mode else following.name)
        lasts = ", until disarmed" if fault.lasts else ""
        lines.append(f"| {fault.text.format(**ModeParameters()._asdict())}{lasts} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def progress_table() -> str:
    """Return what leads on without a request, as Markdown."""
    lines = ["| in | when | then |", "|---|---|---|"]
    lines += [
        f"| {mode.name} | {text.format(**ModeParameters()._asdict())} | {then.name} |"
        for mode, _, then, text in PROGRESS
    ]
    return "\n".join(lines)


def request_table() -> str:
    """Return mode x request as Markdown; a dash: refused."""
    lines = ["| request | " + " | ".join(f"in {mode.name}" for mode in Mode) + " |", "|---|" + "---|" * len(Mode)]
    for request, granted in GRANTED.items():
        cells = [granted[mode].name if mode in granted else "-" for mode in Mode]
        lines.append(f"| {words(request.name)} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


GROUND = (
    "In DISARMED, PILOT and KILL nothing changes, but in DISARMED a guard that stopped the motors is KILL, and a "
    "pilot who takes over is PILOT. Until a vehicle that takes off is clear of the ground, HOLD is LAND, on request "
    "too: what holds there slides. It is clear 0.7 m above where it was armed, after 2 s higher than 0.15 m, or where "
    "its estimate is 1.4 m higher. A GOTO, and the height of a take-off that is lower, hold all the same."
)
TOLD = (
    "The battery level comes from `battery_state` (`sensor_msgs/BatteryState`), published by a battery driver, else "
    "from the autopilot. Without either the battery counts as full. The trust in the position, a pilot and a land "
    "detector come from an autopilot's bridge (`flight/autopilot`); without an autopilot these rows are never "
    "triggered. An estimator's reset comes from a bridge or the odometry relay. The guard judges states for itself."
)
REFUSAL = (
    "A request is refused if a condition would end its mode at once; the answer names the condition. DISARM in PILOT "
    "needs contact with the ground. A dash: refused."
)


def page() -> str:
    """Return the tables of docs/reference/modes.md."""
    severity = " < ".join(mode.name for mode in MODES)
    parts = ["## What is wrong, and what happens", f"The more severe mode wins: {severity}. Empty: the mode stays."]
    parts += [fault_table(), GROUND, TOLD, "## What leads on by itself", progress_table()]
    parts += ["## What can be asked for", REFUSAL, request_table()]
    return "\n\n".join(parts)

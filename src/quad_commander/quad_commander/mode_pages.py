"""The mode table for people: Markdown tables and a Mermaid diagram, made from ``mode_table``.

``docs/safety.md`` holds ``page()`` between two markers; a test holds both to the same text. To renew it:

    python -m quad_commander.mode_pages docs/safety.md
"""

import sys
from pathlib import Path

from quad_commander.mode_table import ANSWERS, FAULTS, GRANTED, IN_THE_AIR, PROGRESS, TABLE, Condition, Mode, Request
from quad_commander.mode_texts import limits, words
from quad_core.commander_parameters import ModeParameters

BEGIN = "<!-- made by quad_commander.mode_pages: begin -->"
END = "<!-- made by quad_commander.mode_pages: end -->"


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
            cells.append("" if following == mode else Mode(following).name)
        lasts = ", until disarmed" if fault.lasts else ""
        lines.append(f"| {fault.text.format(**limits(ModeParameters()))}{lasts} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def progress_table() -> str:
    """Return what leads on without a request, as Markdown."""
    lines = ["| in | when | then |", "|---|---|---|"]
    lines += [
        f"| {mode.name} | {text.format(**limits(ModeParameters()))} | {then.name} |" for mode, _, then, text in PROGRESS
    ]
    return "\n".join(lines)


def request_table() -> str:
    """Return mode x request as Markdown; a dash: refused."""
    lines = ["| request | " + " | ".join(f"in {mode.name}" for mode in Mode) + " |", "|---|" + "---|" * len(Mode)]
    for request in GRANTED:
        cells = [Mode(ANSWERS[mode][request]).name if ANSWERS[mode][request] >= 0 else "-" for mode in Mode]
        lines.append(f"| {words(Request(request).name)} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def diagram() -> str:
    """Return the modes as a Mermaid state diagram: faults that lead from one mode to another share an arrow."""
    lines = ["```mermaid", "stateDiagram-v2", "    [*] --> DISARMED"]
    lines += [f"    {mode.name} --> {then.name}: {words(condition.name)}" for mode, condition, then, _ in PROGRESS]
    for request, answers in GRANTED.items():
        for mode, then in answers.items():
            if mode != then and then < mode and mode != Mode.KILL:
                lines.append(f"    {mode.name} --> {then.name}: request {words(request.name)}")
    lines += ["    DISARMED --> ARMING: request arm, takeoff", "    HOLD --> MISSION: request mission"]
    lines = list(dict.fromkeys(lines))
    for mode in (Mode.MISSION, Mode.HOLD, Mode.LAND, Mode.DESCEND):
        for then in (Mode.HOLD, Mode.LAND, Mode.DESCEND, Mode.PILOT, Mode.KILL):
            causes = [fault.condition for fault in FAULTS if then != mode and TABLE[mode][fault.condition] == then]
            if causes:
                some = ", ".join(words(Condition(cause).name) for cause in causes[:3])
                lines.append(f"    {mode.name} --> {then.name}: {some}{', ...' if len(causes) > 3 else ''}")
    return "\n".join([*lines, "```"])


GROUND = (
    "In DISARMED, PILOT and KILL nothing changes, but: a guard that stopped the motors is KILL, and a pilot who takes "
    "over is PILOT, in DISARMED too."
)
UNTOLD = {
    "position_good": "the trust in the position",
    "estimator_reset": "an estimator's reset",
    "pilot": "a pilot",
}
"""{field of ``Health`` that no node of this stack tells the commander: its words}."""
NOT_TOLD = (
    "The battery is what somebody says on `battery_state` (`sensor_msgs/BatteryState`: a driver of it, the vehicle's "
    "owner); without it it counts as full. "
    f"No node tells the commander of {', '.join(list(UNTOLD.values())[:-1])} or {list(UNTOLD.values())[-1]} yet: their "
    "rows wait for a vehicle that does. Of these the "
    "guard judges states for itself, and the bridges, which fly without a commander, leave the vehicle to a pilot."
)
REFUSAL = (
    "A request is refused, naming the condition, if the mode that it leads to would be left at once. DISARM in PILOT "
    "needs contact with the ground. A dash: refused."
)


def page() -> str:
    """Return the part of ``docs/safety.md`` that is made from the table."""
    severity = " < ".join(mode.name for mode in Mode)
    parts = ["### What is wrong, and what happens", f"The more severe mode wins: {severity}. Empty: the mode stays."]
    parts += [fault_table(), GROUND, NOT_TOLD, "### What leads on by itself", progress_table()]
    parts += ["### What can be asked for", REFUSAL, request_table(), "### As a picture", diagram()]
    return "\n\n".join(parts)


def renewed(text: str) -> str:
    """Return the page ``text`` with the part between the markers made anew. Raises ValueError without markers."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"found no {BEGIN} ... {END}, expected both")
    return f"{before}{BEGIN}\n\n{page()}\n\n{END}{after}"


def main(arguments: list[str] | None = None) -> int:
    """Renew the file named by the first argument, or print the page; exit code 2: the file has no markers."""
    names = sys.argv[1:] if arguments is None else arguments
    if not names:
        sys.stdout.write(page() + "\n")
        return 0
    file = Path(names[0])
    try:
        file.write_text(renewed(file.read_text(encoding="utf-8")), encoding="utf-8")
    except (OSError, ValueError) as error:
        sys.stderr.write(f"{file}: {error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

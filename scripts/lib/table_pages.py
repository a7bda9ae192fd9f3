"""Reference pages that are tables of the code: command line, metrics, modes, laws, services and events."""

import argparse
import contextlib
import importlib
import io
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import api_pages
import mode_pages
import yaml

from quad_analysis.metrics import METRICS
from quad_commander.mode_table import Condition
from quad_commander.modes import words
from quad_commander.services import SERVICES
from quad_core import plugins
from quad_core.enumerations import GuardMode, Mode, Request
from quad_flight import set_up
from quad_guard import guard

ROOT = Path(__file__).resolve().parents[2]
GROUPS = (
    plugins.POSITION_LAW,
    plugins.ATTITUDE_LAW,
    plugins.TRAJECTORY,
    plugins.PLANT,
    plugins.DISTURBANCE,
    plugins.SENSING,
)

COMMANDS = {
    "scripts/fly": "quad_bringup.fly",
    "scripts/log": "quad_report.cli",
    "scripts/campaign": "quad_campaign.campaign_cli",
    "scripts/identify": "quad_identify.cli",
    "scripts/check_link": "quad_px4.check_link",
    "scripts/study": "study",
    "scripts/tune": "tune",
    "ros2 run quad_commander command": "quad_commander.command",
}
COMMAND_HEAD = """# Command line

Every command explains itself with `--help`; so does `scripts/log COMMAND --help`, with examples. Without a sourced
ROS 2 `ros2 run PACKAGE NAME` is `install/PACKAGE/lib/PACKAGE/NAME`, in a shell that has sourced `scripts/env.sh`.

## Exit codes

| code | meaning |
| --- | --- |
| 0 | good: the flight ended as planned and within its limits, or the command did what was asked |
| 1 | the flight, the check or the bag is not good; the last lines say why |
| 2 | wrong usage or set-up, nothing was flown; the message names file, key or topic, what was found and expected |

A node exits with the code of its flight. `command` exits with 0: done, 1: refused, 2: no answer.
"""
METRICS_HEAD = """# Metrics

Computed from a bag by `scripts/log metrics`, `report`, `check` and at the end of `scripts/fly`. `p` is `truth`, or
`state` where the bag has no truth or the laws fly on an autopilot's estimate. `p_d` is `reference`, compared at the
steps for which it was computed. Time starts at the end of the approach (`trajectory_time` 0). With a mission, only
MISSION counts. Each command is held until the next one. `n/a`: the data is missing, the event never happened, or, of
the two over frequencies, commands that are not evenly spaced (real time). A study adds `cost` and `over_hover`, the
integral of the squared thrust over that of hovering, less 1.
"""
MODES_HEAD = """# Modes, conditions and guard reasons

What they are for: [safety](../explanation/safety.md). Numbers are those of the messages `FlightMode` and `GuardStatus`.
"""
CONDITIONS_HEAD = """## Conditions

`FlightMode.raised`: bit k is set while condition k holds. `FlightMode.reason` is the number of the condition that led
to the mode.
"""
LAWS_HEAD = """# Laws, presets, vehicles

Any position law flies with any attitude law, plant and vehicle. Gains are in acceleration, so `tuned` carries over to
other masses; delay, noise and lag need gains of their own.
"""
SERVICES_HEAD = """# Services and events

## Services

All are `std_srvs/Trigger`, but `goto`, a `quad_msgs/Goto` with the place. The answer says when it takes effect, or
why not. Names are relative. `command` calls them. Every node also has the parameter services of ROS 2.
"""
EVENTS_HEAD = """## Events

Topic `flight/events` (`FlightEvent`): severity, kind and one line of text. Events of a scenario have the kind of that
event, changes of mode the kind `mode`, granted requests `request`, what a bridge asks of its autopilot
`px4_command` and the like.
"""
EVENTS: dict[str, str | dict[str, str]] = yaml.safe_load(
    Path(__file__).with_name("event_meanings.yaml").read_text(encoding="utf-8")
)


def rows(head: list[str], lines: Iterable[list[str]]) -> str:
    """Return a Markdown table."""
    shown = [head, ["---"] * len(head), *lines]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in shown) + "\n"


def metrics_page() -> str:
    """Return docs/reference/metrics.md."""
    lines = [[f"`{name}`", metric.unit or "1", metric.meaning] for name, metric in METRICS.items()]
    return METRICS_HEAD + "\n" + rows(["metric", "unit", "meaning"], lines)


def modes_page() -> str:
    """Return docs/reference/modes.md: numbers, what each means, and the tables of the modes."""
    requests = [[str(request.value), words(request.name)] for request in Request]
    reasons = [[str(int(number)), text] for number, text in guard.REASONS.items()]
    modes = ", ".join(f"{mode.value} {mode.name.lower()}" for mode in GuardMode)
    about_guard = f"`mode`: {modes}. `reason` says why the mode was entered, `condition` what holds now."
    parts = [
        MODES_HEAD,
        "## Modes (`FlightMode.mode`)\n",
        rows(["number", "mode"], [[str(mode.value), mode.name] for mode in Mode]),
        CONDITIONS_HEAD,
        rows(["number", "condition"], [[str(one.value), words(one.name)] for one in Condition]),
        "## Requests (`FlightRequest.request`)\n",
        rows(["number", "request"], requests),
        f"## Guard (`GuardStatus`)\n\n{about_guard}\n",
        rows(["number", "reason"], reasons),
        mode_pages.page() + "\n",
    ]
    return "\n".join(parts)


def laws_page() -> str:
    """Return docs/reference/laws.md: plug-ins, presets and vehicles that ship."""
    parts = [LAWS_HEAD]
    for group in GROUPS:
        found = [(name, plugins.load(group, name)) for name in plugins.names(group)]
        lines = [
            [f"`{name}`", first_line(module), ", ".join(f"`{key}`" for key in getattr(module, "PRESETS", {})) or ""]
            for name, module in found
            if module.__name__.startswith("quad_")
        ]
        parts += [f"## {group}\n", rows(["name", "what it is", "presets of its module"], lines)]
    for title, kind in (
        ("Presets (`--preset`)", set_up.CONTROLLERS),
        ("Vehicles (`--vehicle`)", set_up.VEHICLES),
        ("Scenarios (`CASE`, `--scenario`)", set_up.SCENARIOS),
    ):
        parts += [
            f"## {title}\n",
            rows(["name", "what its file says"], ([f"`{n}`", about(kind, n)] for n in set_up.shipped_names(kind))),
        ]
    return "\n".join(parts)


def first_line(module: Any) -> str:
    """Return the first line of a plug-in's docstring, without the group, which heads the table."""
    line = (module.__doc__ or "").strip().splitlines()[0]
    return re.sub(r"[,;] a ``quad\.\w+`` plug-in", "", line).replace("``", "`")


def about(kind: str, name: str) -> str:
    """Return the comment with which a shipped parameter file begins."""
    (path,) = ROOT.glob(f"src/quad_flight/quad_flight/config/{Path(kind).name}/{name}.yaml")
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("# "))
    return " ".join(lines)


def services_page() -> str:
    """Return docs/reference/services_and_events.md."""
    asks = "asks for {}; refused where the mode does not allow it"
    calls = [[f"`{one.name.lower()}`", "commander", asks.format(one.name)] for one in SERVICES if one != Request.END]
    calls.append(["`end`", "commander", "ends the flight as Ctrl-C does; never refused"])
    services = rows(["service", "node", "what it does"], calls)
    events = rows(["kind", "severity", "package", "what it means"], event_rows())
    return "\n".join([SERVICES_HEAD, services, EVENTS_HEAD, events])


def event_rows() -> list[list[str]]:
    """Return one row per kind: those of ``events.warn("kind", text)`` and the like, and the named.

    Raises KeyError for a kind without a meaning and ValueError for a meaning whose kind is in no source.
    """
    sources = {path: path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("src/*/quad_*/**/*.py"))}
    if gone := [kind for kind in EVENTS if not any(f'"{kind}"' in source for source in sources.values())]:
        raise ValueError(f"event_meanings.yaml: found {', '.join(gone)}, expected kinds that the sources send")
    found: dict[str, tuple[set[str], set[str]]] = {kind: (set(), set()) for kind in EVENTS}
    for path, source in sources.items():
        sent = re.findall(r"(?<!log\.)\b(info|warn|error)\(\s*\"(\w+)\"", source)
        sent += [("warn", kind) for kind in re.findall(r"\"(rejected_\w+)\"", source)]
        sent += [("error", kind) for kind in re.findall(r"_give_up\(\"(\w+)\"", source)]  # of the odometry relay
        for severity, kind in sent:
            severities, packages = found.setdefault(kind, (set(), set()))
            severities.add(severity.replace("warn", "warning"))
            packages.add(path.relative_to(ROOT / "src").parts[0])
    for kind, (_, packages) in found.items():
        if not packages:  # sent by a name
            packages |= {path.relative_to(ROOT / "src").parts[0] for path in sources if f'"{kind}"' in sources[path]}
    return [event_row(kind, *found[kind]) for kind in sorted(found)]


def event_row(kind: str, severities: set[str], packages: set[str]) -> list[str]:
    """Return the row of one kind; a meaning may give severity and package that its source does not show."""
    meaning = EVENTS[kind]
    if isinstance(meaning, dict):
        return [f"`{kind}`", meaning["severity"], meaning["package"], meaning["means"]]
    return [f"`{kind}`", ", ".join(sorted(severities)) or "warning", ", ".join(sorted(packages)), meaning]


class _CapturedError(Exception):
    """Carries the parser of a command."""


def parser_of(module: str) -> argparse.ArgumentParser:
    """Return the parser that a command makes before it reads its arguments."""

    def capture(self: argparse.ArgumentParser, *_: Any, **__: Any) -> None:
        raise _CapturedError(self)

    original = argparse.ArgumentParser.parse_args
    argparse.ArgumentParser.parse_args = capture  # type: ignore[assignment,method-assign]
    try:
        sys.path.insert(0, str(ROOT / "studies"))
        with contextlib.redirect_stderr(io.StringIO()):
            importlib.import_module(module).main([])
    except _CapturedError as captured:
        return captured.args[0]  # type: ignore[no-any-return]
    finally:
        argparse.ArgumentParser.parse_args = original  # type: ignore[method-assign]
    raise AssertionError(f"{module}: main() read no arguments")


def command_page() -> str:
    """Return docs/reference/command_line.md."""
    parts = [COMMAND_HEAD]
    for command, module in COMMANDS.items():
        parts += command_section(command, parser_of(module), 2)
    return "\n".join(parts)


def command_section(command: str, parser: argparse.ArgumentParser, level: int) -> list[str]:
    """Return the section of one command."""
    parts = [f"{'#' * level} {command}\n", " ".join((parser.description or "").split()) + "\n"]
    lines, verbs = [], []
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            verbs = list(action.choices.items())
        elif not isinstance(action, argparse._HelpAction):
            lines.append(argument_row(action))
    if lines:
        parts.append(rows(["argument", "value", "meaning", "default"], lines))
    if parser.epilog:
        parts.append("```\n" + parser.epilog.strip("\n") + "\n```\n")
    for verb, inner in verbs:
        parts += command_section(f"{command} {verb}", inner, level + 1)
    return parts


def argument_row(action: argparse.Action) -> list[str]:
    """Return name, value, meaning and default of one argument."""
    value = action.metavar if isinstance(action.metavar, str) else ""
    if not value and action.choices:
        value = ", ".join(str(choice) for choice in action.choices)
    name = ", ".join(action.option_strings) or value or action.dest
    shown = "" if action.default in (None, False, argparse.SUPPRESS, [], "") else str(action.default)
    return [f"`{name}`", value if action.option_strings else "", (action.help or "").replace("%%", "%"), shown]


def pages() -> dict[str, str]:
    """Return {file name in docs/reference: text} of all pages of this module."""
    return {
        "api.md": api_pages.page(),
        "command_line.md": command_page(),
        "metrics.md": metrics_page(),
        "modes.md": modes_page(),
        "laws.md": laws_page(),
        "services_and_events.md": services_page(),
    }

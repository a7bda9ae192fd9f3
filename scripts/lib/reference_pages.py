"""Reference pages from the code: the topic table, the .msg files, the declarations of parameters."""

import argparse
import re
import sys
import textwrap
from collections.abc import Iterable
from importlib.metadata import EntryPoints
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import diagrams
import documentation_site
import fault_pages
import table_pages

from quad_core import plugins
from quad_core.cascade import ALL_ROLES, OPTIONAL_NODES, ROLES, VEHICLE_INTERFACES
from quad_core.flight_parameters import FlightParameters
from quad_core.parameters import Choice, Field, Flag, Real, Whole, fields
from quad_core.vehicle import Vehicle
from quad_node.topics import TOPICS, Topic

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
REFERENCE = DOCS / "reference"
MESSAGES = ROOT / "src" / "quad_msgs" / "msg"
GENERATED = "<!-- Written by scripts/docs from the code: change it there. -->"

STANDARD_TYPES = {
    "geometry_msgs/WrenchStamped": (
        "`header.stamp`: stamp of the state that it answers. `header.frame_id`: `base_link`. `wrench.force.z`: "
        "collective thrust along body z in N (x and y are 0). `wrench.torque`: torque about the body axes in N m."
    ),
    "nav_msgs/Odometry": (
        "The sensed state (as `state`) for tools, once in `odom_period_steps`: pose in the world, twist in the body "
        "frame; covariances 0."
    ),
    "sensor_msgs/BatteryState": (
        "`percentage`: share of full, 0 to 1, NaN where it is unknown. Best effort, so that any driver matches; no "
        "node of this stack publishes it. The commander lands below `modes.battery_low` and does not arm below "
        "`arming.battery`, nor on a percentage beyond 0 to 1. Without a message an autopilot's "
        "counts, without either it is full."
    ),
    "rosgraph_msgs/Clock": "Flight time for tools, once in `clock_period_steps`; no control decision depends on it.",
}
OUTSIDE = {"flight/request": "an operator; the vehicle interface at the end", "battery_state": "a battery driver"}
"""{topic that comes from outside of the flight's nodes: its publisher}."""
TOPICS_HEAD = """# Topics

Names are relative: a namespace gives a second vehicle. SI units, radians, ENU world, FLU body, quaternions xyzw (body
to world), Z-Y-X Euler angles. All topics but `battery_state` are reliable; *latched* ones (transient local) reach nodes
that join later. A *step* topic has exactly one message per step of its publisher. One that is both shows only its
newest message; between the nodes it is `NAME/steps`, not latched. The payload hash covers the step topics but
`flight/mode`, which names the run. Every node also publishes `diagnostics` (diagnostic_msgs/DiagnosticArray) at 1 Hz.
For viewers the recorder makes, publishes and records `pose`, `reference_pose` (geometry_msgs/PoseStamped) and `/tf`
(tf2_msgs/TFMessage); beside the odometry relay it records them alone.

*to*: the nodes that the publisher waits for before a flight. Others read too: the odometry relay `actuation` and
`flight/mode`, the commander `flight/events`, a vehicle interface without a commander `reference` and
`attitude_setpoint`, the bridges of autopilots `attitude_setpoint`.
"""
PARAMETERS_HEAD = """# Parameters

Every parameter of every node with its default, range and source; a value of another type, out of range, NaN, or for a
name that is not listed is refused. *live*: may be set in flight. Give them as `--set NODE.PARAM=VALUE` to
`scripts/fly`, as `-p PARAM:=VALUE` to `ros2 run`, or in a ROS 2 parameter file (those that ship:
`src/quad_flight/quad_flight/config`).

"""
SUMMARIES = {
    "simulator": "Takes `wrench_setpoint`, publishes `state`, `truth`, `actuation`, `disturbance`.",
    "trajectory": "Answers `state` with `reference`.",
    "position_controller": "Answers `state` and `reference` with `attitude_setpoint`.",
    "attitude_controller": "Answers `state` and `attitude_setpoint` with `wrench_setpoint`.",
    "recorder": "Writes the topics of a flight into one bag and paces the lockstep.",
    "commander": "Modes and missions: takes `mission/reference`, publishes `reference` and `flight/mode`; optional.",
    "odometry_relay": "Turns an estimator's `odom` into `state`; optional.",
    "crazyflie_bridge": "A Crazyflie as the vehicle: [how to](../../how_to/crazyflie.md); optional.",
    "joined_plant": "Our plant under PX4, flown by our laws: [how to](../../how_to/px4.md); optional.",
    "mavlink_bridge": "A vehicle with PX4 or ArduPilot, over MAVLink: [how to](../../how_to/mavlink.md); optional.",
    "px4_bridge": "A vehicle with PX4, over uXRCE-DDS: [how to](../../how_to/px4.md); optional.",
}


def type_name(topic: Topic) -> str:
    """Return ``package/Type`` of a topic."""
    return f"{topic.type.__module__.split('.')[0]}/{topic.type.__name__}"


def table(head: list[str], rows: Iterable[list[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines) + "\n"


def topics_page() -> str:
    """Return docs/reference/topics.md."""
    rows = []
    for topic in TOPICS.values():
        kind = ", ".join(word for word, holds in (("step", topic.step), ("latched", topic.latched)) if holds)
        name = type_name(topic)
        target = name.split("/")[1].lower() if name.startswith("quad_msgs/") else name.replace("/", "").lower()
        sides = ["all nodes" if set(side) == set(ROLES) else ", ".join(side) for side in topic[2:4]]
        sides[0] = OUTSIDE.get(topic.name, sides[0])
        rows.append([f"`{topic.name}`", f"[{name}](#{target})", *sides, kind, topic.paper])
    parts = [TOPICS_HEAD, table(["topic", "type", "from", "to", "kind", "paper"], rows)]
    for name in dict.fromkeys(type_name(topic) for topic in TOPICS.values()):
        if name.startswith("quad_msgs/"):
            parts.append(message_section(name.split("/")[1]))
        else:
            parts.append(f"## {name}\n\n{STANDARD_TYPES[name]}\n")
    return page(parts)


def message_section(name: str) -> str:
    """Return the section of one message of ours; the comments of its file say all."""
    about, rows = [], []
    for line in (MESSAGES / f"{name}.msg").read_text(encoding="utf-8").splitlines():
        code, _, comment = line.partition("#")
        if not code.strip():
            about.append(comment.strip())
            continue
        kind, field = code.split(maxsplit=1)
        unit = re.match(r"\s*\[([^]]*)\]\s*", comment)
        text = comment[unit.end() :] if unit else comment
        rows.append([f"`{field.strip()}`", f"`{kind}`", unit[1] if unit else "", text.strip()])
    return f"## {name}\n\n{' '.join(about)}\n\n{table(['field', 'type', 'unit', 'meaning'], rows)}"


def parameter_pages() -> dict[str, str]:
    """Return {file name: text} of docs/reference/parameters."""
    pages = {}
    roles: dict[str, Any] = {**ROLES, **OPTIONAL_NODES, **VEHICLE_INTERFACES}
    for role, kind in roles.items():
        parts = [
            f"# {role}\n\n`ros2 run {ALL_ROLES[role].package} {role}`. {SUMMARIES[role]}\n",
            field_table(fields(kind.parameters)),
        ]
        for slot, group in kind.slots.items():
            parts += [plugin_section(slot, group, name) for name in plugins.names(group)]
        parts.append("Shared with all nodes: [flight.* and vehicle.*](shared.md).\n")
        pages[f"{role}.md"] = page(parts)
    shared = ["# Shared by all nodes\n", field_table(fields(FlightParameters, "flight."))]
    pages["shared.md"] = page([*shared, field_table(fields(Vehicle, "vehicle."))])
    listed = [f"- [{name.removesuffix('.md')}]({name})" for name in pages]
    pages["README.md"] = page([PARAMETERS_HEAD + "\n".join(listed) + "\n"])
    return pages


def plugin_section(slot: str, group: str, name: str) -> str:
    """Return the section of one plug-in: what its module says of itself, its parameters, its presets."""
    module = plugins.load(group, name)
    summary = (module.__doc__ or "").strip().splitlines()[0]
    text = f"## {slot}: {name}\n\n{summary}\n\n{field_table(fields(module.Parameters, f'{name}.', slot == 'law'))}"
    for preset, values in getattr(module, "PRESETS", {}).items():
        if values:
            rows = [[f"`{name}.{key}`", f"`{shown(value)}`"] for key, value in values.items()]
            text += f"\n### preset {preset}\n\n{table(['parameter', 'value'], rows)}"
    return text


def field_table(listed: Iterable[Field]) -> str:
    """Return the table of parameters."""
    head = ["parameter", "default", "unit", "range", "meaning", "source", "live"]
    return table(head, (field_row(field) for field in listed))


def field_row(field: Field) -> list[str]:
    """Return one line of the table of parameters."""
    spec = field.spec
    if isinstance(spec, Real):
        bounds = f"{spec.low:g} .. {spec.high:g}"
    elif isinstance(spec, Whole):
        bounds = f"{spec.low} .. {spec.high}"
    elif isinstance(spec, Choice):
        bounds = ", ".join(spec.options)
    else:
        bounds = "true, false" if isinstance(spec, Flag) else "text"
    unit = spec.unit if isinstance(spec, Real | Whole) else ""
    live = "live" if field.live else ""
    return [f"`{field.name}`", f"`{shown(field.default)}`", unit, bounds, spec.meaning, spec.source, live]


def shown(value: object) -> str:
    """Return a value as YAML has it."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) else str(value) or "''"


def page(parts: Iterable[str]) -> str:
    """Return a whole page; lines of prose are at most 118 characters long."""
    lines, code = [], False
    for line in "\n".join(part.rstrip("\n") + "\n" for part in parts).split("\n"):
        code ^= line.startswith("```")
        prose = not code and not line.startswith(("|", "#", "```", "-", "!"))
        lines += textwrap.wrap(line, 118, break_on_hyphens=False) if prose and len(line) > 118 else [line]
    return GENERATED + "\n" + "\n".join(lines)


def leave_out_plugins_of_the_user() -> None:
    """Let the plug-ins be those of this repository: the pages do not depend on what else is installed."""
    installed = plugins.installed()

    def ours(**wanted: Any) -> EntryPoints:
        return EntryPoints(point for point in installed.select(**wanted) if point.value.startswith("quad_"))

    plugins.installed = lambda: SimpleNamespace(select=ours)  # type: ignore[assignment]


def main() -> int:
    """Write the pages, or with --check say which are not up to date."""
    parser = argparse.ArgumentParser(prog="scripts/docs", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a page is not up to date")
    parser.add_argument("--site", action="store_true", help="build the site in build/site, every warning an error")
    options = parser.parse_args()
    if options.site:
        return documentation_site.build()
    check = options.check
    leave_out_plugins_of_the_user()
    pages = {
        REFERENCE / "topics.md": topics_page(),
        REFERENCE / "faults.md": GENERATED + "\n" + fault_pages.faults_page(),
    }
    pages |= {REFERENCE / name: page([text]) for name, text in table_pages.pages().items()}
    pages |= {DOCS / "images" / name: text for name, text in diagrams.pictures().items()}
    pages |= {REFERENCE / "parameters" / name: text for name, text in parameter_pages().items()}
    stale = [path for path, text in pages.items() if not path.exists() or path.read_text(encoding="utf-8") != text]
    stale += [path for path in (REFERENCE / "parameters").glob("*.md") if path not in pages]
    lacking = documentation_site.missing() if check else []
    for line in lacking:
        print(line)
    for path in stale:
        print(f"{path.relative_to(ROOT)}: {'not up to date: run scripts/docs' if check else 'written'}")
    if not check:
        for folder in (REFERENCE / "parameters", DOCS / "images"):
            folder.mkdir(exist_ok=True)
        for path in stale:
            if path in pages:
                path.write_text(pages[path], encoding="utf-8")
            else:
                path.unlink()
    return 1 if check and (stale or lacking) else 0


if __name__ == "__main__":
    sys.exit(main())

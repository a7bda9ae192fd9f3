"""A layout for Foxglove and a configuration for RViz, made from the topics and their message classes.

One tab of what a flight is about, then one per step topic with a plot for each of its quantities.
"""

import json
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import yaml

from quad_core.cascade import COMMAND
from quad_flight_log.errors import FlightLogError, SchemaError
from quad_flight_log.recorder.message_fields import SIZES, Field, fields_of, message_class, type_name
from quad_flight_log.report.interactive_figures import PALETTE

_NOT_PLOTTED = ("stamp", "header", "step", "run", "next_step")
_OVERVIEW = {
    "x [m]": ("reference.p_w[0]", "truth.p_w[0]"),
    "y [m]": ("reference.p_w[1]", "truth.p_w[1]"),
    "z [m]": ("reference.p_w[2]", "truth.p_w[2]"),
    "angles: wanted, filtered [rad]": (
        "attitude_setpoint.angles[0]",
        "attitude_controller/internals.desired_angles[0]",
        "attitude_setpoint.angles[1]",
        "attitude_controller/internals.desired_angles[1]",
        "attitude_setpoint.angles[2]",
        "attitude_controller/internals.desired_angles[2]",
    ),
    "thrust: commanded, achieved [N]": (f"{COMMAND}.wrench.force.z", "actuation.thrust"),
}


class Curve(NamedTuple):
    """One number of a message over time. ``path``: as in Foxglove, ``p_w[0]`` or ``wrench.force.z``."""

    topic: str
    path: str


class Plot(NamedTuple):
    """Curves in one pair of axes."""

    title: str
    curves: tuple[Curve, ...]


class Tab(NamedTuple):
    """Plots over one another."""

    title: str
    plots: tuple[Plot, ...]


def tabs(kinds: Mapping[str, type], namespace: str = "") -> list[Tab]:
    """Return the tabs of the step topics ``kinds`` ({relative name: message class}).

    Raises SchemaError naming a path of the overview that no definition has any more.
    """
    overview = []
    for title, paths in _OVERVIEW.items():
        curves = [Curve(*path.split(".", 1)) for path in paths]
        for curve in curves:
            _check(curve, kinds)
        overview.append(Plot(title, tuple(curves)))
    found = [Tab("flight", tuple(overview))]
    found += [Tab(topic, tuple(_plots(topic, kind))) for topic, kind in kinds.items()]
    return [_within(tab, namespace.strip("/")) for tab in found]


def foxglove(found: list[Tab], namespace: str = "") -> str:
    """Return a Foxglove layout (JSON): the 3-D view of the markers next to the tabs."""
    panels: dict[str, Any] = {}
    listed = []
    for tab in found:
        names = []
        for plot in tab.plots:
            name = f"Plot!{_identifier(tab.title, plot.title)}"
            panels[name] = _foxglove_plot(plot)
            names.append(name)
        listed.append({"title": tab.title, "layout": _stacked(names)})
    prefix = f"/{namespace.strip('/')}" if namespace.strip("/") else ""
    panels["3D!space"] = {
        "followTf": "map",
        "followMode": "follow-none",
        "topics": {f"{prefix}/{topic}": {"visible": True} for topic in ("markers", "pose", "odom")},
        "cameraState": {"distance": 40, "phi": 60, "thetaOffset": 45, "perspective": True},
    }
    panels["Tab!curves"] = {"activeTabIdx": 0, "tabs": listed}
    layout = {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {"direction": "row", "first": "3D!space", "second": "Tab!curves", "splitPercentage": 40},
    }
    return json.dumps(layout, indent=1) + "\n"


def rviz(namespace: str = "") -> str:
    """Return a configuration of RViz: grid, transforms, markers and the path of the vehicle, in the frame map."""
    prefix = f"/{namespace.strip('/')}" if namespace.strip("/") else ""

    def display(name: str, kind: str, **more: Any) -> dict[str, Any]:
        return {"Class": f"rviz_default_plugins/{kind}", "Name": name, "Enabled": True, "Value": True, **more}

    view = {"Class": "rviz_default_plugins/Orbit", "Distance": 15.0, "Pitch": 0.6, "Yaw": 0.8}
    content = {
        "Visualization Manager": {
            "Global Options": {"Fixed Frame": "map", "Background Color": "245; 246; 248"},
            "Displays": [
                display("Grid", "Grid", **{"Cell Size": 1.0, "Plane Cell Count": 20}),
                display("TF", "TF"),
                display("Markers", "MarkerArray", Topic={"Value": f"{prefix}/markers", "Depth": 5}),
                display("Pose", "Pose", Topic={"Value": f"{prefix}/pose", "Depth": 5}, Shape="Axes"),
                display("Odometry", "Odometry", Topic={"Value": f"{prefix}/odom", "Depth": 5}, Keep=1),
            ],
            "Views": {"Current": view},
        },
    }
    return str(yaml.safe_dump(content, sort_keys=False))


def layout_files(namespace: str = "") -> dict[str, str]:
    """Return {file name: text} of the layouts of this installation's topics; FlightLogError where there is no ROS."""
    try:
        from quad_node.topics import TOPICS
    except ImportError as error:
        raise FlightLogError(f"layouts need ROS 2 and the messages of this workspace ({error})") from error
    kinds = {topic.name: topic.type for topic in TOPICS.values() if topic.step}
    return {"flight.json": foxglove(tabs(kinds, namespace), namespace), "flight.rviz": rviz(namespace)}


def numbers(kind: type) -> list[tuple[str, list[str], bool]]:
    """Return (field, paths to its numbers, whether they are flags) of all fields of fixed size in a message."""
    found = []
    for field in fields_of(kind):
        if field.name not in _NOT_PLOTTED:
            paths = _paths(field)
            if paths:
                found.append((field.name, paths, field.base == "boolean"))
    return found


def _paths(field: Field) -> list[str]:
    if field.length < 0 or field.base == "string":
        return []
    places = [f"{field.name}[{index}]" for index in range(field.length)] if field.length else [field.name]
    if field.base in SIZES:
        return places
    inner = [path for part in fields_of(message_class(field.base)) for path in _paths(part)]
    return [f"{place}.{path}" for place in places for path in inner]


def _plots(topic: str, kind: type) -> list[Plot]:
    plots, flags = [], []
    for name, paths, is_flag in numbers(kind):
        if is_flag:
            flags += paths
        else:
            plots.append(Plot(name, tuple(Curve(topic, path) for path in paths)))
    if flags:
        plots.append(Plot("flags", tuple(Curve(topic, path) for path in flags)))
    return plots


def _check(curve: Curve, kinds: Mapping[str, type]) -> None:
    kind = kinds.get(curve.topic)
    if kind is None:
        raise SchemaError(f"layout: no topic {curve.topic!r}; there are {', '.join(kinds)}")
    if curve.path not in {path for _, paths, _ in numbers(kind) for path in paths}:
        raise SchemaError(f"layout: {type_name(kind)} of topic {curve.topic!r} has no number {curve.path!r}")


def _within(tab: Tab, namespace: str) -> Tab:
    prefix = f"/{namespace}/" if namespace else "/"
    plots = [
        plot._replace(curves=tuple(curve._replace(topic=prefix + curve.topic) for curve in plot.curves))
        for plot in tab.plots
    ]
    return tab._replace(plots=tuple(plots))


def _foxglove_plot(plot: Plot) -> dict[str, Any]:
    paths = [
        {
            "value": f"{curve.topic}.{curve.path}",
            "enabled": True,
            "timestampMethod": "receiveTime",
            "color": PALETTE[index % len(PALETTE)],
        }
        for index, curve in enumerate(plot.curves)
    ]
    return {
        "foxglovePanelTitle": plot.title,
        "paths": paths,
        "showLegend": True,
        "legendDisplay": "floating",
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "isSynced": True,
        "xAxisVal": "timestamp",
    }


def _stacked(names: list[str]) -> Any:
    """Return the mosaic of panels of equal height over one another."""
    if len(names) == 1:
        return names[0]
    share = 100.0 / len(names)
    return {"direction": "column", "first": names[0], "second": _stacked(names[1:]), "splitPercentage": round(share, 3)}


def _identifier(*words: str) -> str:
    return "-".join(re.sub(r"\W+", "-", word).strip("-") for word in words)

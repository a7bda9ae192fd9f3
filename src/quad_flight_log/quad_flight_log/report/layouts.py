"""A layout for Foxglove and a configuration for RViz: the vehicle in space, and the plots that every flight needs."""

import json
from pathlib import Path
from typing import Any

import yaml

from quad_flight_log.report.figures import PALETTE

PLOTS = {
    "x, y, z: wanted, flown [m]": [f"{topic}.p_w[{axis}]" for axis in range(3) for topic in ("reference", "truth")],
    "roll, pitch, yaw: wanted, filtered [rad]": [
        f"{topic}[{axis}]"
        for axis in range(3)
        for topic in ("attitude_setpoint.angles", "attitude_controller/internals.desired_angles")
    ],
    "thrust: commanded, achieved [N]": ["wrench_setpoint.wrench.force.z", "actuation.thrust"],
}
"""{title: what is plotted, as topic and path}"""
SPACE = ("pose", "reference_pose", "odom")


def write_layouts(directory: Path, namespace: str) -> list[Path]:
    """Write flight.json and flight.rviz for a vehicle into ``directory``, return their paths; raises OSError."""
    directory.mkdir(parents=True, exist_ok=True)
    prefix = f"/{namespace.strip('/')}/".replace("//", "/")
    paths = [directory / "flight.json", directory / "flight.rviz"]
    for path, content in zip(paths, (_foxglove(prefix), _rviz(prefix)), strict=True):
        path.write_text(content, encoding="utf-8")
    return paths


def _foxglove(prefix: str) -> str:
    panels: dict[str, Any] = {
        f"Plot!{number}": {
            "foxglovePanelTitle": title,
            "paths": [
                {"value": prefix + path, "enabled": True, "timestampMethod": "receiveTime", "color": colour}
                for path, colour in zip(paths, PALETTE, strict=False)
            ],
            "showLegend": True,
            "isSynced": True,
            "xAxisVal": "timestamp",
        }
        for number, (title, paths) in enumerate(PLOTS.items())
    }
    below = {"direction": "column", "first": "Plot!1", "second": "Plot!2", "splitPercentage": 50}
    column = {"direction": "column", "first": "Plot!0", "second": below, "splitPercentage": 33}
    panels["3D!space"] = {
        "followTf": "map",
        "followMode": "follow-none",
        "topics": {f"{prefix}{topic}": {"visible": True} for topic in SPACE},
        "cameraState": {"distance": 40, "phi": 60, "thetaOffset": 45, "perspective": True},
    }
    layout = {"direction": "row", "first": "3D!space", "second": column, "splitPercentage": 40}
    rest = {"globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1}}
    return json.dumps({"configById": panels, **rest, "layout": layout}, indent=1) + "\n"


def _rviz(prefix: str) -> str:
    displays: list[dict[str, Any]] = [
        {"Class": "Grid", "Cell Size": 1.0, "Plane Cell Count": 20},
        {"Class": "TF"},
        {"Class": "Pose", "Topic": "pose", "Shape": "Axes"},
        {"Class": "Pose", "Topic": "reference_pose", "Shape": "Arrow", "Color": "127; 137; 148"},
        {"Class": "Odometry", "Topic": "odom", "Keep": 500, "Shape": {"Value": "Arrow", "Shaft Length": 0.05}},
    ]
    for each in displays:
        name = each.get("Topic", each["Class"])
        each.update({"Class": f"rviz_default_plugins/{each['Class']}", "Name": name, "Enabled": True})
        if "Topic" in each:
            each["Topic"] = {"Value": f"{prefix}{each['Topic']}", "Depth": 5}
    view = {"Class": "rviz_default_plugins/Orbit", "Distance": 15.0, "Pitch": 0.6, "Yaw": 0.8}
    options = {"Fixed Frame": "map", "Background Color": "245; 246; 248"}
    content = {"Global Options": options, "Displays": displays, "Views": {"Current": view}}
    return str(yaml.safe_dump({"Visualization Manager": content}, sort_keys=False))

"""A configuration for RViz: vehicle and reference in space."""

from pathlib import Path
from typing import Any

import yaml


def write_rviz(directory: Path, namespace: str) -> Path:
    """Write flight.rviz for a vehicle into ``directory`` and return its path; raises OSError."""
    directory.mkdir(parents=True, exist_ok=True)
    prefix = f"/{namespace.strip('/')}/".replace("//", "/")
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
    path = directory / "flight.rviz"
    path.write_text(yaml.safe_dump({"Visualization Manager": content}, sort_keys=False), encoding="utf-8")
    return path

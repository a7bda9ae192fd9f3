"""What a bag says about itself and its flight: rosbag2's ``metadata.yaml`` (version 9), QoS, and our own records."""

import hashlib
import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import yaml

from quad_flight_log.errors import CorruptError

LIBRARY = "quad_flight_log 2"  # how the library string of our recorder begins: its files have every checksum
METADATA_FILE = "metadata.yaml"
QUAD = "quad"  # metadata record written at the start
QUAD_END = "quad_end"  # metadata record written at the end

_DIGEST = "sha256"
_FOREVER = {"sec": 9223372036, "nsec": 854775807}


def qos_profile(*, latched: bool) -> dict[str, Any]:
    """Return the QoS of a topic as rosbag2 writes it."""
    return {
        "history": "keep_last",
        "depth": 1 if latched else 10,
        "reliability": "reliable",
        "durability": "transient_local" if latched else "volatile",
        "deadline": _FOREVER,
        "lifespan": _FOREVER,
        "liveliness": "automatic",
        "liveliness_lease_duration": _FOREVER,
        "avoid_ros_namespace_conventions": False,
    }


def topic_metadata(name: str, kind: str, type_hash: str, profile: Mapping[str, Any]) -> dict[str, Any]:
    """Return what rosbag2 notes about a topic, without messages yet."""
    about = {
        "name": name,
        "type": kind,
        "serialization_format": "cdr",
        "offered_qos_profiles": [profile],
        "type_description_hash": type_hash,
    }
    return {"topic_metadata": about, "message_count": 0}


def bag_metadata(
    file_name: str, topics: Sequence[Mapping[str, Any]], start_ns: int, end_ns: int, custom: Mapping[str, str]
) -> dict[str, Any]:
    """Return what rosbag2 notes about a bag with one MCAP file (BagMetadata, version 9)."""
    span = {
        "duration": {"nanoseconds": end_ns - start_ns},
        "starting_time": {"nanoseconds_since_epoch": start_ns},
        "message_count": sum(topic["message_count"] for topic in topics),
    }
    return {
        "version": 9,
        "storage_identifier": "mcap",
        **span,
        "topics_with_message_count": topics,
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file_name],
        "files": [{"path": file_name, **span}],
        "custom_data": dict(custom),
        "ros_distro": "jazzy",
    }


def as_yaml(content: Any) -> str:
    """Return YAML without aliases, which not every reader of bags knows."""
    copied = json.loads(json.dumps(content))  # nothing in it is shared
    return str(yaml.safe_dump(copied, sort_keys=False))


def sealed_notes(values: Mapping[str, str]) -> dict[str, str]:
    """Return ``values`` with their digest: a cut file has no other checksum of them."""
    return {**values, _DIGEST: _digest(values)}


def opened_notes(values: Mapping[str, str], where: str, *, strict: bool) -> dict[str, str]:
    """Return notes without their digest; raises CorruptError if it does not fit, or is missing although ``strict``."""
    rest = {key: value for key, value in values.items() if key != _DIGEST}
    if (strict or _DIGEST in values) and values.get(_DIGEST) != _digest(rest):
        raise CorruptError(f"{where}: its digest does not fit its content")
    return rest


def _digest(values: Mapping[str, str]) -> str:
    return hashlib.sha256(json.dumps(dict(values), sort_keys=True).encode()).hexdigest()


COMMAND = "QUAD_COMMAND"  # environment variable that holds the command which started the flight
LIMITS = "QUAD_LIMITS"  # environment variable with what the flight is held to: METRIC=VALUE, comma, ...
STEPPED = "QUAD_STEP"  # environment variable with step, hash of the vehicle, hash of the gains, blanks between them
STEP, STEP_VEHICLE, STEP_GAINS = NOTED = ("step", "step_vehicle", "step_gains")  # the same in the bag's notes
BENCH = "bench"  # the step without propellers
LIMIT = "limit."  # before the name of a metric in the bag's notes
ROTORS, CURVE = "rotors", "curve"  # of an imported log: order of its motors, square's share in thrust over command
STOPPED = "recorder stopped before the end of the flight"  # reason in the notes of a bag that ends before its flight


def git_commit(directory: Path | None = None) -> str:
    """Return the commit of the sources ("-dirty" if changed since), empty where they are not in a git repository."""
    folder = directory or Path(__file__).resolve().parent
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=5.0, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def flight_metadata(facts: Mapping[str, object], versions: Mapping[str, str]) -> dict[str, str]:
    """Return what is known of ``facts`` (run id, seed, ...), wall time of the start, command, commit, versions."""
    started = datetime.now(timezone.utc).isoformat(timespec="milliseconds")
    found = {key: str(value) for key, value in facts.items()}
    found.update(started=started, command=os.environ.get(COMMAND, ""), git_commit=git_commit())
    for item in filter(None, os.environ.get(LIMITS, "").split(",")):
        name, _, value = item.partition("=")
        found[LIMIT + name] = value
    found.update(zip(NOTED, os.environ.get(STEPPED, "").split(), strict=False))
    found.update({f"version.{name}": value for name, value in versions.items()})
    return {key: value for key, value in found.items() if value}

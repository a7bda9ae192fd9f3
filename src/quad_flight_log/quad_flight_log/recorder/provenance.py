"""Where a flight came from: noted at the start of its bag."""

import os
import subprocess
from collections.abc import Mapping
from datetime import datetime, timezone
from pathlib import Path

COMMAND = "QUAD_COMMAND"  # environment variable that holds the command which started the flight
LIMITS = "QUAD_LIMITS"  # environment variable with what the flight is held to: METRIC=VALUE, comma, ...
STEPPED = "QUAD_STEP"  # environment variable with step, hash of the vehicle, hash of the gains, blanks between them
STEP, STEP_VEHICLE, STEP_GAINS = NOTED = ("step", "step_vehicle", "step_gains")  # the same in the bag's notes
BENCH = "bench"  # the step without propellers
LIMIT = "limit."  # before the name of a metric in the bag's notes
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

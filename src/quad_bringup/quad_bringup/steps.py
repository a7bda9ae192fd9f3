"""``fly --step``: first flights in five steps, each within limits of its own and opened by a bag that passed the last.

A bag notes its step, and hashes of its vehicle and of its gains. It has passed if it is judged good once more, now.
"""

import hashlib
import json
import math
import os
import shlex
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from quad_analysis.flight_checks import judgement
from quad_analysis.tables import measured, recorded_parameters
from quad_core.cascade import SIMULATOR, STAGES
from quad_core.node_parameters import StepLimits
from quad_core.parameters import ParameterError, flatten
from quad_core.resolution import Resolved
from quad_flight_log.errors import FlightLogError
from quad_flight_log.notes import BENCH, COMMAND, METADATA_FILE, STEP, STEP_GAINS, STEP_VEHICLE
from quad_flight_log.reader import open_flight

SHOWN = 4  # bags that do not open a step and are named


class Step(NamedTuple):
    """The limits of a step, and the mission that is flown where no other is asked for; empty: it must be."""

    limits: StepLimits
    mission: str = ""


def within(degrees: float, speed: float, box: float, thrust: float) -> StepLimits:
    """Return limits of a step: degrees, m/s, m, and a thrust that may differ from the weight by a share of it."""
    return StepLimits(math.radians(degrees), speed, box, 1.0 - thrust, 1.0 + thrust)


STEPS = {
    BENCH: Step(StepLimits(most_thrust=0.3), "takeoff:0.3,hold:25,land"),
    "hop": Step(within(10.0, 0.5, 1.0, 0.2), "takeoff:0.5,hold:5,land"),
    "hover": Step(within(15.0, 1.0, 2.0, 0.3), "takeoff:1,hold:30,land"),
    "box": Step(within(20.0, 2.0, 3.0, 0.5), "takeoff:1.5,goto:1 0 1.5,goto:1 1 1.5,goto:0 1 1.5,goto:0 0 1.5,land"),
    "full": Step(StepLimits(tilt=math.radians(35.0), speed=5.0)),
}
"""In the order in which they open. On the bench the propellers are off, and no thrust could lift the vehicle."""
_ORDER = list(STEPS)
_SHARE = 0.6
"""Of the largest speed of a step: that of the commander's own references."""


_UNPROPELLED = "\n".join(f"rotor number={number} effectiveness=0" for number in (1, 2, 3, 4))
_ON_A_BENCH = [
    f"{SIMULATOR}.sensing=hand",
    f"{SIMULATOR}.disturbance=timeline",
    f"{SIMULATOR}.timeline.events={_UNPROPELLED}",
]


class Prints(NamedTuple):
    """Hashes of a vehicle and of the gains that fly it."""

    vehicle: str
    gains: str


def mission_of(name: str, asked: str | None) -> str:
    """Return the mission of a step; raises ParameterError for a step that needs one."""
    if mission := asked or STEPS[name].mission:
        return mission
    raise ParameterError(f"--step {name}: found no mission, expected one: --mission takeoff:2,case2,hold:5,land")


def settings(name: str, simulated: bool) -> list[str]:
    """Return what a step sets, as --set takes it, where nothing else is asked for; ``simulated``: in calm air."""
    limits = STEPS[name].limits
    if name == BENCH:
        return _ON_A_BENCH if simulated else []
    speed = f"{_SHARE * min(limits.speed, 1.0 / _SHARE):g}"
    found = [f"commander.references.{axis}.speed={speed}" for axis in ("horizontal", "climb", "landing")]
    if name == _ORDER[-1]:  # a plan that asks for more is refused before the flight
        found += [f"commander.limits.{field}={getattr(limits, field)!r}" for field in ("speed", "tilt")]
    return [f"{SIMULATOR}.disturbance=none", *found] if simulated else found


def limit_values(name: str) -> dict[str, float]:
    """Return {parameter of a vehicle interface: value} of the limits of a step, which nothing may widen."""
    return {f"guard.step.{field}": float(value) for field, value in STEPS[name].limits._asdict().items()}


def prints(nodes: Mapping[str, Resolved], interface: str) -> Prints:
    """Return the hashes of a flight; ``interface``: NAME=FILE of a vehicle interface, whose file counts by its text."""
    name, _, file = interface.partition("=")
    vehicle: dict[str, Any] = {**flatten(nodes[SIMULATOR].vehicle), "interface": name}
    if file:
        try:
            vehicle["file"] = Path(file).read_text(encoding="utf-8")
        except UnicodeDecodeError as error:
            raise ParameterError(f"{file}: found {error.reason} at byte {error.start}, expected UTF-8") from error
    gains: dict[str, Any] = {"plant_period": nodes[SIMULATOR].flight.plant_period}
    for role in (stage.role for stage in STAGES if stage.role in nodes):
        fields = nodes[role].all_fields()
        gains |= {f"{role}.{each.name}": each.default for each in fields if not each.name.startswith(_SHARED)}
    return Prints(_hash(vehicle), _hash(gains))


_SHARED = ("flight.", "vehicle.")


def _hash(values: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()[:16]


def opening_bag(name: str, asked: Prints, folders: Iterable[Path]) -> Path | None:
    """Return the bag in ``folders`` that opens a step, None for the first; raises ParameterError where none does.

    The newest that passed the step before, with this vehicle and these gains.
    """
    if name == _ORDER[0]:
        return None
    before = _ORDER[_ORDER.index(name) - 1]
    refused = []
    for bag, noted in _bags(before, folders):
        refusal = _refusal(bag, noted, asked)
        if not refusal:
            return bag
        refused.append(f"{bag}: {refusal}")
    found = "; ".join(refused[:SHOWN]) + (f"; and {len(refused) - SHOWN} more" if len(refused) > SHOWN else "")
    looked = ", ".join(map(str, folders))
    raise ParameterError(
        f"--step {name}: found {found or f'no bag of step {before} in {looked}'}; expected one that passed step "
        f"{before} with this vehicle and these gains. What opens it: {_command(name, before)}"
    )


def _bags(step: str, folders: Iterable[Path]) -> Iterator[tuple[Path, Mapping[str, str]]]:
    """Yield the bags of a step in ``folders`` with their notes, the newest first."""
    files = {file for folder in folders for file in folder.glob(f"*/{METADATA_FILE}")}
    for file in sorted(files, key=lambda each: each.stat().st_mtime, reverse=True):
        noted = _notes(file)
        if noted.get(STEP) == step:
            yield file.parent, noted


def _notes(file: Path) -> Mapping[str, str]:
    """Return what the recorder noted in a bag's metadata; nothing of a bag of others."""
    try:
        about = yaml.safe_load(file.read_text(encoding="utf-8"))
        return dict(about["rosbag2_bagfile_information"]["custom_data"])
    except (OSError, ValueError, yaml.YAMLError, LookupError, TypeError):
        return {}


def _refusal(bag: Path, noted: Mapping[str, str], asked: Prints) -> str:
    """Return why a bag does not open the next step, empty if it does."""
    if noted.get(STEP_VEHICLE) != asked.vehicle:
        return "another vehicle"
    if noted.get(STEP_GAINS) != asked.gains:
        return "other gains"
    try:
        flight = open_flight(bag)
        judged = judgement(flight, measured(flight))
        if judged.verdict != "good":
            return judged.text
        if any(node.changes for node in recorded_parameters(flight).values()):
            return "gains were changed in flight"
    except FlightLogError as error:
        return str(error)
    same = (flight.metadata.get(STEP_VEHICLE), flight.metadata.get(STEP_GAINS)) == asked
    return "" if same else "its notes are not those of its metadata.yaml"


def _command(name: str, before: str) -> str:
    """Return the command of this flight for the step ``before``."""
    words, kept = shlex.split(os.environ.get(COMMAND, f"scripts/fly --step {name}")), list[str]()
    for word in words:
        last = kept[-1] if kept else ""
        if last in ("--mission", "--out"):
            kept.pop()
        elif last == "--step":
            kept.append(before)
        elif not word.startswith(("--mission=", "--out=")):
            kept.append(f"--step={before}" if word.startswith("--step=") else word)
    return shlex.join(kept)


def described(name: str) -> str:
    """Return the limits of a step in words."""
    limits, off = STEPS[name].limits, StepLimits()
    parts = []
    if limits.tilt != off.tilt:
        parts.append(f"{math.degrees(limits.tilt):g} deg, {limits.speed:g} m/s")
    if limits.box != off.box:
        parts.append(f"{limits.box:g} m from the take-off")
    if limits.most_thrust != off.most_thrust:
        parts.append(f"{limits.most_thrust:g} of the weight")
    return f"at most {', '.join(parts)}"

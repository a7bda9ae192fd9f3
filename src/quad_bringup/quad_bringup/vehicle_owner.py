"""`--vehicle-owner`: which bridge is started in the simulator's place, and what must be there for it."""

import argparse
from pathlib import Path

from quad_bringup.processes import executable
from quad_core.cascade import CRAZYFLIE, JOINED, MAVLINK, PX4, SIMULATOR, STAGES, TRAJECTORY
from quad_core.parameters import ParameterError

BRIDGES = {"px4": PX4, "joined": JOINED, "mavlink": MAVLINK, "crazyflie": CRAZYFLIE}
PAGES = {"joined": "px4"}
"""{name: its page in docs, where that has another name}."""
AUTOPILOT = "autopilot"
"""The limits of flights on an autopilot's estimate."""
_PERIODS = {"crazyflie": 5_000_000}
"""Plant period in ns; 4 ms, the grid of PX4's states, where it is not named."""
_NO_TIMEOUT = 60
"""Seconds of wall time after which a controller levels, joined: the plant waits, so nothing ages meanwhile."""


def commands(options: argparse.Namespace) -> dict[str, list[str]]:
    """Return {simulator: the bridge's command}, empty without `--vehicle-owner`; raises ParameterError."""
    if not options.vehicle_owner:
        return {}
    name, _, file = options.vehicle_owner.partition("=")
    page = f"docs/how_to/{PAGES.get(name, name)}.md"
    expected = f"--vehicle-owner: found {options.vehicle_owner!r}, expected"
    if name not in BRIDGES:
        raise ParameterError(f"{expected} one of {', '.join(BRIDGES)}, and =FILE with its parameters")
    if not file:
        raise ParameterError(f"{expected} {name}=FILE: the vehicle's own parameters, {page}")
    if not Path(file).is_file():
        raise ParameterError(f"--vehicle-owner: {name}: found no file {file!r}, expected its parameters, {page}")
    if not options.realtime:
        raise ParameterError("--vehicle-owner: found lockstep, expected --realtime: a vehicle's clock cannot be halted")
    if any(given.startswith(f"{SIMULATOR}=") for given in options.own):
        raise ParameterError("--vehicle-owner: found --own simulator as well, expected one of them")
    return {SIMULATOR: [str(executable(BRIDGES[name])), "--ros-args", "--params-file", str(Path(file).resolve())]}


def settings(options: argparse.Namespace) -> list[str]:
    """Return what the bridge needs of the other nodes, as --set takes it; the user's settings come after it."""
    name = (options.vehicle_owner or "").partition("=")[0]
    if name not in BRIDGES:
        return []
    found = [f"flight.plant_period={_PERIODS.get(name, 4_000_000)}"]
    found += [f"{role}.period_steps=2" for role in (TRAJECTORY, *(stage.role for stage in STAGES))]
    patience = [f"{stage.role}.input_timeout={_NO_TIMEOUT}" for stage in STAGES] if name == "joined" else []
    return found + patience

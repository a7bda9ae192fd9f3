"""`--vehicle-owner`: which bridge is started in the simulator's place, and what must be there for it."""

import argparse
from pathlib import Path

from quad_bringup.processes import executable
from quad_core.cascade import CRAZYFLIE, MAVLINK, PX4, SIMULATOR
from quad_core.parameters import ParameterError

BRIDGES = {"px4": PX4, "mavlink": MAVLINK, "crazyflie": CRAZYFLIE}


def commands(options: argparse.Namespace) -> dict[str, list[str]]:
    """Return {simulator: the bridge's command}, empty without `--vehicle-owner`; raises ParameterError."""
    if not options.vehicle_owner:
        return {}
    name, _, file = options.vehicle_owner.partition("=")
    expected = f"--vehicle-owner: found {options.vehicle_owner!r}, expected"
    if name not in BRIDGES:
        raise ParameterError(f"{expected} one of {', '.join(BRIDGES)}, and =FILE with its parameters")
    if not file:
        raise ParameterError(f"{expected} {name}=FILE: the vehicle's own parameters, docs/{name}.md")
    if not Path(file).is_file():
        raise ParameterError(
            f"--vehicle-owner: {name}: found no file {file!r}, expected its parameters, docs/{name}.md"
        )
    if not options.realtime:
        raise ParameterError("--vehicle-owner: found lockstep, expected --realtime: nobody can halt a vehicle's clock")
    if any(given.startswith(f"{SIMULATOR}=") for given in options.own):
        raise ParameterError("--vehicle-owner: found --own simulator as well, expected one of them")
    return {SIMULATOR: [str(executable(BRIDGES[name])), "--ros-args", "--params-file", str(Path(file).resolve())]}

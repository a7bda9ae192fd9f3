"""`--vehicle-interface`: which vehicle interface is started in the simulator's place, and what must be there for it."""

import argparse
from pathlib import Path

from quad_bringup import steps
from quad_bringup.processes import executable
from quad_core.cascade import SIMULATOR, VEHICLE_INTERFACES
from quad_core.parameters import ParameterError

INTERFACES = {interface.name: role for role, interface in VEHICLE_INTERFACES.items() if interface.name}
"""{name: role} of the vehicle interfaces that fly can start."""
AUTOPILOT = "autopilot"  # the limits of flights on an autopilot's estimate


def commands(options: argparse.Namespace) -> dict[str, list[str]]:
    """Return {simulator: the interface's command}, empty without `--vehicle-interface`; raises ParameterError."""
    if not options.vehicle_interface:
        return {}
    name, _, file = options.vehicle_interface.partition("=")
    expected = f"--vehicle-interface: found {options.vehicle_interface!r}, expected"
    if name not in INTERFACES:
        raise ParameterError(f"{expected} one of {', '.join(INTERFACES)}, and =FILE with its parameters")
    interface = VEHICLE_INTERFACES[INTERFACES[name]]
    page = interface.page
    if not file:
        raise ParameterError(f"{expected} {name}=FILE: the vehicle's own parameters, {page}")
    if not Path(file).is_file():
        raise ParameterError(f"--vehicle-interface: {name}: found no file {file!r}, expected its parameters, {page}")
    if not options.realtime:
        raise ParameterError("--vehicle-interface: found lockstep, expected --realtime: its clock cannot be halted")
    if interface.autopilot_lands and options.mission is None:
        example = "--mission takeoff:2,case2,hold:5,land"
        raise ParameterError(f"--vehicle-interface: {name}: found no mission, expected one: {example}")
    if any(given.startswith(f"{SIMULATOR}=") for given in options.own):
        raise ParameterError("--vehicle-interface: found --own simulator as well, expected one of them")
    command = [str(executable(INTERFACES[name])), "--ros-args", "--params-file", str(Path(file).resolve())]
    limits = steps.limit_values(options.step) if options.step else {}
    return {SIMULATOR: [*command, *(word for key, value in limits.items() for word in ("-p", f"{key}:={value!r}"))]}


def settings(options: argparse.Namespace) -> list[str]:
    """Return what the bridge needs of the other nodes, as --set takes it; the user's settings come after it."""
    name = (options.vehicle_interface or "").partition("=")[0]
    return list(VEHICLE_INTERFACES[INTERFACES[name]].settings) if name in INTERFACES else []

"""The parameters that all nodes of one flight share (``flight.*``)."""

from typing import Annotated, NamedTuple

from quad_core.cascade import ROLES
from quad_core.enumerations import FlightClock
from quad_core.parameters import Choice, Real, Text, Whole

_UNCOMMANDED = "real time without a commander: age of the"


class FlightParameters(NamedTuple):
    """Shared by all nodes of one flight; times are of the wall clock."""

    mode: Annotated[int, Choice(FlightClock, "lockstep: the plant waits; realtime: not")] = FlightClock.LOCKSTEP.value
    run_id: Annotated[str, Text("name of the run; nodes of another run are refused; empty: any")] = ""
    seed: Annotated[int, Whole("", "seed of every random stream of the flight", 0, 2**31 - 1)] = 1
    plant_period: Annotated[int, Whole("ns", "time between two states", 100_000, 1_000_000_000)] = 2_000_000
    roles: Annotated[str, Text("roles that take part, comma separated; step 0 waits for all")] = ",".join(ROLES)
    start_timeout: Annotated[float, Real("s", "time that a node waits for the others at the start", 0.5, 3600.0)] = 60.0
    silence_timeout: Annotated[float, Real("s", "time without flight/state until a node exits", 1.0, 3600.0)] = 20.0
    setpoint_timeout: Annotated[float, Real("s", f"{_UNCOMMANDED} attitude_setpoint that lands", 0.02, 60.0)] = 0.3
    reference_timeout: Annotated[float, Real("s", f"{_UNCOMMANDED} reference that lands the vehicle", 0.02, 60.0)] = 2.0
    realtime_priority: Annotated[int, Whole("", "real time: SCHED_FIFO priority if permitted; 0: none", 0, 99)] = 40

    @property
    def role_names(self) -> tuple[str, ...]:
        """The names in ``roles``, blanks around them left out."""
        return tuple(name.strip() for name in self.roles.split(","))

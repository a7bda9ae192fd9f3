"""From 42 % less thrust on every pair of laws sinks alike: a limit that all share, and not the laws."""

import pytest

from quad_core import plugins
from quad_core.vehicle import Vehicle
from quad_flight.flight import fly, from_names
from quad_position_ctrl.setpoint import LiftLimits

pytestmark = pytest.mark.skipif(
    "aibs" not in plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)
SHARED = ("limits.acceleration_z=20.0",)
BOUNDS = {"aibs": ("observer.max_estimate=20.0",), "pid": ("z.max_integral=20.0",)}


def sunk(law, effectiveness, raised):
    """Return how far in m the vehicle is off at the end of 6 s of hover with a share of its thrust."""
    settings = ["simulator.guard.enabled=false", f"simulator.rigid_body.effectiveness.thrust={effectiveness}"]
    settings += [f"position_controller.{law}.{setting}" for setting in ((*SHARED, *BOUNDS[law]) if raised else ())]
    flight = from_names("hover", position=law, attitude="pid", duration=6.0, settings=settings)
    return fly(flight, logging=False).score.last_error


def test_the_share_follows_from_the_limit():
    """Hover asks for U_z = g (1 / e - 1): at the shared limit of 7 m/s^2 that is e = 0.583."""
    assert Vehicle().gravity / (Vehicle().gravity + LiftLimits().acceleration_z) == pytest.approx(0.583, abs=1e-3)


@pytest.mark.parametrize("law", ["aibs", "pid"])
def test_below_that_share_the_limit_decides(law):
    assert sunk(law, 0.55, raised=False) > 1.0
    assert sunk(law, 0.55, raised=True) < 0.5

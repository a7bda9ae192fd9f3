"""What a bag says about a flight: its metrics. For programs; needs no ROS."""

from quad_flight_log.metrics import FlightMetrics, flight_metrics
from quad_flight_log.reader import Flight

MEASURED = (
    "truth",
    "reference",
    "attitude_setpoint",
    "wrench_setpoint",
    "actuation",
    "disturbance",
    "position_controller/internals",
    "attitude_controller/internals",
)


def measured(flight: Flight) -> FlightMetrics:
    """Return the metrics of an opened flight from whatever of the needed topics it has."""
    return flight_metrics(flight.arrays(*(topic for topic in MEASURED if flight.has(topic))))

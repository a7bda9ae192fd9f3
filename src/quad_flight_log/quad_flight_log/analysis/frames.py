"""A recorded flight for programs and notebooks: metrics, and pandas data frames. Needs no ROS.

flight = open_flight("flights/case1-1-1")
flight.array("truth")["p_w"]                       NumPy, shape (n, 3)
frame(flight, "truth")["p_w[2]"]                   pandas, indexed by time
"""

from typing import TYPE_CHECKING

from quad_flight_log.analysis.metrics import FlightMetrics, flight_metrics
from quad_flight_log.analysis.tables import flight_tables
from quad_flight_log.bag.messages import flat_columns
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import TopicError

if TYPE_CHECKING:
    import pandas as pd


def measured(flight: Flight) -> FlightMetrics:
    """Return the metrics of an opened flight from whatever of the needed topics it has.

    Raises TopicError if it lacks all of them.
    """
    tables = flight_tables(flight)
    if not tables:
        raise TopicError(f"{flight.path}: holds no topic of a flight: there is nothing to measure")
    return flight_metrics(tables)


def frame(flight: Flight, topic: str) -> "pd.DataFrame":
    """Return a topic as a pandas data frame: one column per number (``p_w[0]``), indexed by ``time`` in s.

    ``time`` is the message's stamp, or the time of recording if the type has no stamp.
    """
    import pandas as pd

    table = flight.array(topic)
    times = table["stamp_ns" if "stamp_ns" in (table.dtype.names or ()) else "log_ns"] * 1e-9
    return pd.DataFrame(dict(flat_columns(table)), index=pd.Index(times, name="time"))

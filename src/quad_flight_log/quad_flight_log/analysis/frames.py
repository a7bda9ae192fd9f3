"""A recorded flight for programs and notebooks: metrics, data frames, topics aligned by stamp. Needs no ROS.

flight = open_flight("flights/case1-1-1")
flight.array("truth")["p_w"]                       NumPy, shape (n, 3)
frame(flight, "truth")["p_w[2]"]                   pandas, indexed by time
aligned_frame(flight, "truth", "reference")        one row per stamp that both have
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from quad_flight_log.analysis.arrays import by_stamp
from quad_flight_log.analysis.metrics import FlightMetrics, flight_metrics
from quad_flight_log.analysis.tables import flight_tables
from quad_flight_log.bag.messages import Table
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


def aligned_arrays(flight: Flight, *topics: str, forward_fill: bool = False) -> dict[str, Table]:
    """Return {topic: array} with the same stamps in every row, repeats dropped; all of shape (n,).

    Stamps are those that all topics have; with ``forward_fill`` those of the first topic, and of each other topic the
    newest message at or before (rows before every topic has one are left out).
    Raises TopicError for a topic without stamps.
    """
    tables = {topic: by_stamp(_stamped(flight, topic, table)) for topic, table in flight.arrays(*topics).items()}
    stamps = [table["stamp_ns"] for table in tables.values()]
    if not stamps:
        return {}
    if forward_fill:
        common = stamps[0]
        for other in stamps[1:]:
            common = common[common >= (other[0] if len(other) else np.iinfo(np.int64).max)]
    else:
        common = stamps[0]
        for other in stamps[1:]:
            common = np.intersect1d(common, other, assume_unique=True)
    return {
        topic: table[np.searchsorted(table["stamp_ns"], common, side="right") - 1] for topic, table in tables.items()
    }


def frame(flight: Flight, topic: str) -> "pd.DataFrame":
    """Return a topic as a pandas data frame: one column per number (``p_w[0]``), indexed by ``time`` in s.

    ``time`` is the message's stamp, or the time of recording if the type has no stamp.
    """
    return _frame(flight, {topic: flight.array(topic)}, prefix=False)


def aligned_frame(flight: Flight, *topics: str, forward_fill: bool = False) -> "pd.DataFrame":
    """Return ``aligned_arrays`` as one data frame; columns are named ``topic.field``."""
    return _frame(flight, aligned_arrays(flight, *topics, forward_fill=forward_fill), prefix=True)


def _frame(flight: Flight, tables: dict[str, Table], prefix: bool) -> "pd.DataFrame":
    import pandas as pd

    content: dict[str, Any] = {}
    times: Any = None
    for topic, table in tables.items():
        if times is None:
            times = table["stamp_ns" if "stamp_ns" in (table.dtype.names or ()) else "log_ns"] * 1e-9
        for column in flight.columns(topic, table):
            content[f"{topic}.{column.name}" if prefix else column.name] = column.values
    return pd.DataFrame(content, index=pd.Index(times if times is not None else [], name="time"))


def _stamped(flight: Flight, topic: str, table: Table) -> Table:
    if "stamp_ns" not in (table.dtype.names or ()):
        raise TopicError(
            f"{flight.path}: {topic}: {flight.topics[flight.resolve(topic)].type} has no stamp to align by"
        )
    return table

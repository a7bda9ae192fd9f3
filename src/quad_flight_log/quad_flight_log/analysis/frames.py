"""A recorded flight for programs and notebooks: metrics, and pandas data frames. Needs no ROS.

flight = open_flight("flights/case1-1-1")
flight.array("truth")["p_w"]                       NumPy, shape (n, 3)
frame(flight, "truth")["p_w[2]"]                   pandas, indexed by time
aligned_frame(flight, "truth", "reference")        one row per stamp that both have
"""

from typing import TYPE_CHECKING

from quad_flight_log.analysis.metrics import FlightMetrics, flight_metrics
from quad_flight_log.analysis.tables import flight_tables
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
    content = {column.name: column.values for column in flight.columns(topic, table)}
    return pd.DataFrame(content, index=pd.Index(times, name="time"))


def aligned_frame(flight: Flight, *topics: str, forward_fill: bool = False) -> "pd.DataFrame":
    """Return topics as one data frame, a row per stamp, repeats dropped; columns are named ``topic.field``.

    Stamps are those that all topics have; with ``forward_fill`` those of the first topic, and of each other topic the
    newest message at or before (rows before every topic has one are left out).
    Raises TopicError for a topic without stamps.
    """
    import pandas as pd

    frames = []
    for topic in topics:
        found = frame(flight, topic)
        if "stamp_ns" not in found:
            kind = flight.topics[flight.resolve(topic)].type
            raise TopicError(f"{flight.path}: {topic}: {kind} has no stamp to align by")
        found = found.drop_duplicates("stamp_ns").sort_values("stamp_ns")
        frames.append(found.set_index("stamp_ns", drop=False).add_prefix(f"{topic}.").rename_axis("stamp"))
    joined = frames[0]
    for other in frames[1:]:
        if forward_fill:
            since = joined[joined.index >= other.index.min()]
            joined = pd.merge_asof(since, other, left_index=True, right_index=True)
        else:
            joined = joined.join(other, how="inner")
    return joined.set_index(pd.Index(joined.index * 1e-9, name="time"))

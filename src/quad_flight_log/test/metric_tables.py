"""Tables of a few rows for tests of metrics."""

import numpy as np

from quad_flight_log.messages import structured

SECOND = 1_000_000_000


def table(stamps, **columns):
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    return structured({"stamp_ns": np.asarray(stamps, np.int64), **arrays})


def seconds(*times):
    return [round(time * SECOND) for time in times]

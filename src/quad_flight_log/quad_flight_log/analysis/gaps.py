"""Messages of a flight that its bag lacks, counted by their stamps."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray


def missing_messages(tables: Mapping[str, NDArray[np.void]]) -> dict[str, int]:
    """Return {topic: messages missing between the first and the last stamp of all ``tables``}.

    ``tables``: {topic: array with ``stamp_ns``}, sorted, without repeats, not empty. A topic has a message every so
    often as is most frequent in it; what comes up to half of that late, after a late plant, is no gap. Of a topic
    with fewer than three messages nothing can be said: 0.
    """
    stamps = {topic: table["stamp_ns"] for topic, table in tables.items()}
    first = min((int(found[0]) for found in stamps.values()), default=0)
    last = max((int(found[-1]) for found in stamps.values()), default=0)
    return {topic: _missing(found, first, last) for topic, found in stamps.items()}


def _missing(stamps: NDArray[np.int64], first: int, last: int) -> int:
    if len(stamps) < 3:
        return 0
    spacings, counts = np.unique(np.diff(stamps), return_counts=True)
    period = int(spacings[counts.argmax()])
    between = (spacings + period // 2) // period - 1
    ends = [max(0, gap // period - 1) for gap in (int(stamps[0]) - first, last - int(stamps[-1]))]
    return int(np.maximum(between, 0) @ counts) + sum(ends)

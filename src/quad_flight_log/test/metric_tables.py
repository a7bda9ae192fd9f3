"""Tables of a few rows for tests of metrics."""

import numpy as np

SECOND = 1_000_000_000


def table(stamps, **columns):
    count = len(stamps)
    forms = [("stamp_ns", np.int64)]
    for name, values in columns.items():
        forms.append((name, np.asarray(values).dtype, np.asarray(values).shape[1:]))
    out = np.zeros(count, forms)
    out["stamp_ns"] = stamps
    for name, values in columns.items():
        out[name] = values
    return out


def seconds(*times):
    return [round(time * SECOND) for time in times]

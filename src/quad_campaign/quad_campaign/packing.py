"""The records of the compiled loop as rows of plain floats, written inside compiled code.

Handing lists of NamedTuples back to CPython costs a hundred times the flight itself.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quad_campaign.loop import Carry, fly
from quad_campaign.records import columns, leaves

Rows = NDArray[np.float64]


def _unbound(*_: Any) -> Any:
    raise RuntimeError("a packer is not bound; call fly_packed through quad_campaign.engine")


pack_truth = pack_state = pack_disturbance = pack_actuation = pack_reference = pack_attitude_setpoint = _unbound
pack_position_internals = pack_wrench_setpoint = pack_attitude_internals = _unbound

Packed = tuple[Rows, Rows, Rows, Rows, Rows, Rows, Rows, Rows, Rows]


def fly_packed(setup: Any, drawn: Any, carry: Carry, steps: int) -> tuple[Carry, Packed]:
    """Return what ``loop.fly`` with logging returns, each list of the records as rows in the order of ``leaves``."""
    after, records = fly(setup, drawn, carry, steps, True)
    return after, (
        pack_truth(records.truth),
        pack_state(records.state),
        pack_disturbance(records.disturbance),
        pack_actuation(records.actuation),
        pack_reference(records.reference),
        pack_attitude_setpoint(records.attitude_setpoint),
        pack_position_internals(records.position_internals),
        pack_wrench_setpoint(records.wrench_setpoint),
        pack_attitude_internals(records.attitude_internals),
    )


@cache
def packer(kind: type[Any]) -> Any:
    """Return the compiled function that turns a list of ``kind`` into rows of floats, one column per leaf."""
    import numba

    names = leaves(columns(kind))
    lines = [
        "def pack(items):",
        f"    rows = np.empty((len(items), {len(names)}))",
        "    for i in range(len(items)):",
        "        item = items[i]",
        *(f"        rows[i, {column}] = item.{name}" for column, name in enumerate(names)),
        "    return rows",
    ]
    scope: dict[str, Any] = {"np": np}
    exec("\n".join(lines), scope)
    return numba.njit(scope["pack"], error_model="numpy", nogil=True)

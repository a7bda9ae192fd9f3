"""What a small computer can fly: the nodes in real time at 100, 250 and 500 Hz, in five processes and in one.

About five minutes. Latency is from a state's publication to its wrench at the simulator.
"""

from ros_runs import Run, stack
from table import Row

from quad_flight.set_up import Request

BENCH = "companion"
RATES = (100, 250, 500)
_SECONDS, _LOCKSTEP_SECONDS = 30.0, 20.0


def measure(rounds: int) -> list[Row]:
    """Return the rows of ``rounds`` flights of each kind."""
    rows = []
    for one_process, name in ((False, "five processes"), (True, "one process")):
        fast = [stack(Request("hover", duration=_LOCKSTEP_SECONDS), one_process) for _ in range(rounds)]
        rows.append(Row(BENCH, f"{name}, lockstep", tuple(run.rate for run in fast), "cycles/s"))
        for rate in RATES:
            period = f"flight.plant_period={round(1e9 / rate)}"
            request = Request("hover", duration=_SECONDS, realtime=True, settings=(period,))
            rows += _rows(f"{name}, {rate} Hz", [stack(request, one_process) for _ in range(rounds)])
    return rows


def _rows(name: str, runs: list[Run]) -> list[Row]:
    rows = [
        Row(BENCH, f"{name}: latency {quantile}", tuple(run.latency[quantile] for run in runs), "ms")
        for quantile in ("p50", "p99", "p99.9")
    ]
    rows.append(Row(BENCH, f"{name}: missed", tuple(100.0 * run.missed / run.steps for run in runs), "%"))
    for role in runs[0].cpu:
        share = tuple(100.0 * run.cpu[role] / run.wall for run in runs)
        rows.append(Row(BENCH, f"{name}: CPU {role}", share, "% of a core"))
    return rows

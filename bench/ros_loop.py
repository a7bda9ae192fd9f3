"""The ROS loop beside a bare relay of the same topics, in lockstep and in real time; idle CPU of the nodes."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from ros_runs import Run, idle, relay, stack
from table import Row, alternated, ratios

from quad_flight.set_up import Request

BENCH = "ros_loop"
_SECONDS = 6.0
# a lockstep flight goes several times as fast: long enough for its end to be watched
_LOCKSTEP_SECONDS = 20.0
_STEPS = 4000
_IDLE = 10.0


def measure(rounds: int) -> list[Row]:
    """Return all rows; paired rounds of relay and stack."""
    rows = []
    rows += _lockstep(rounds, False, "five processes", ">= 0.75", "")
    rows += _lockstep(rounds, True, "one process", "", ">= 0.6")
    rows += _vehicles(rounds)
    for rate in (500, 1000):
        rows += _real_time(rounds, rate)
    used = idle(_IDLE)
    rows += [Row(BENCH, f"idle {role}", (100.0 * share,), "% of a core", "< 1") for role, share in used.items()]
    return rows


def _lockstep(rounds: int, one_process: bool, name: str, bare: str, alike: str) -> list[Row]:
    """Return the rows of the stack beside two relays; ``bare``, ``alike`` are the targets."""
    runs: dict[str, list[Run]] = {"relay": [], "writing": [], "stack": []}

    def noted(key: str, fly: Callable[[], Run]) -> Callable[[], float]:
        def measure_one() -> float:
            runs[key].append(fly())
            return runs[key][-1].rate

        return measure_one

    request = Request("hover", duration=_LOCKSTEP_SECONDS)
    floor, writing, ours = alternated(
        rounds,
        [
            noted("relay", lambda: relay(_STEPS, one_process)),
            noted("writing", lambda: relay(_STEPS, one_process, record=True)),
            noted("stack", lambda: stack(request, one_process)),
        ],
    )
    cpu = {key: [run.cpu_per_cycle for run in found] for key, found in runs.items()}
    return [
        Row(BENCH, f"{name}: bare relay", tuple(floor), "cycles/s"),
        Row(BENCH, f"{name}: stack", tuple(ours), "cycles/s"),
        Row(BENCH, f"{name}: relay that writes a bag", tuple(writing), "cycles/s"),
        Row(BENCH, f"{name}: stack over bare relay", ratios(ours, floor), "", bare),
        Row(BENCH, f"{name}: stack over relay with a bag", ratios(ours, writing), "", alike),
        Row(BENCH, f"{name}: real-time factor at 500 Hz", tuple(rate / 500.0 for rate in ours), ""),
        Row(BENCH, f"{name}: relay, CPU of a cycle", tuple(cpu["relay"]), "us"),
        Row(BENCH, f"{name}: stack, CPU of a cycle", tuple(cpu["stack"]), "us", "", "laws, plant and bag included"),
    ]


def _vehicles(rounds: int) -> list[Row]:
    """Return cycles per second of all vehicles together that fly at once, five processes each."""
    request = Request("hover", duration=_LOCKSTEP_SECONDS)

    def together(count: int) -> float:
        with ThreadPoolExecutor(count) as pool:
            return sum(run.rate for run in pool.map(lambda _: stack(request), range(count)))

    found = alternated(rounds, [lambda: together(1), lambda: together(2), lambda: together(4)])
    return [
        Row(BENCH, f"vehicles at once: {count}", tuple(values), "cycles/s of all")
        for count, values in zip((1, 2, 4), found, strict=True)
    ]


def _real_time(rounds: int, rate: int) -> list[Row]:
    period = round(1e9 / rate)
    request = Request("hover", duration=_SECONDS, realtime=True, settings=(f"flight.plant_period={period}",))
    runs = [stack(request) for _ in range(rounds)]
    name = f"real time {rate} Hz"
    rows = [
        Row(BENCH, f"{name}: latency p50", tuple(run.latency["p50"] for run in runs), "ms", "<= 0.3 at 1 kHz"),
        Row(BENCH, f"{name}: latency p99", tuple(run.latency["p99"] for run in runs), "ms"),
        Row(BENCH, f"{name}: missed", tuple(100.0 * run.missed / run.steps for run in runs), "%", "<= 0.15 at 1 kHz"),
    ]
    for role in runs[0].cpu:
        share = tuple(100.0 * run.cpu[role] / run.wall for run in runs)
        rows.append(Row(BENCH, f"{name}: CPU {role}", share, "% of a core"))
    return rows

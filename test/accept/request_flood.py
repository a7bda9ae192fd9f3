"""A flood of valid requests, 1,000 a second: how much later LAND and KILL take effect; the flood takes nothing back.

The flood is a process of its own, `request_flood.py DOMAIN`: it sends until its standard input is closed.
"""

import contextlib
import statistics
import subprocess
import sys
import threading
import time

from flying import finish, start, stranger, wait_until, wait_until_flying
from rclpy.executors import SingleThreadedExecutor

from quad_msgs.msg import FlightMode, FlightRequest
from quad_node import topics

DOMAIN = 93
CLOCKS = {"lockstep": (), "realtime": ("--realtime",)}
RATE = 1000.0  # Hz
IN_THE_AIR = 1_500_000  # bytes of a bag whose vehicle is above 1 m
LIMITS = {"LAND": 0.050, "KILL": 0.020}  # s by which a flood may delay a request
ROUNDS = 7


def flood(domain):
    """Send HOLD at ``RATE`` until standard input is closed."""
    entry, message = topics.TOPICS["flight/request"], FlightRequest(request=FlightRequest.HOLD, sender="flood")
    closed = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), closed.set()), daemon=True).start()
    with stranger(domain, "flood") as node:
        requests = node.create_publisher(entry.type, entry.name, entry.qos())
        wait_until(lambda: requests.get_subscription_count() > 0, 60.0, "a commander")
        print("begins", flush=True)
        due, sent, began = time.monotonic(), 0, time.monotonic()
        while not closed.is_set():
            requests.publish(message)
            sent, due = sent + 1, due + 1.0 / RATE
            time.sleep(max(0.0, due - time.monotonic()))
        print(round(sent / (time.monotonic() - began)), flush=True)


@contextlib.contextmanager
def flooded(figures, clock):
    """Flood while the block runs."""
    process = subprocess.Popen(
        [sys.executable, __file__, str(DOMAIN)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout.readline() == "begins\n", "the flood found no commander"
        time.sleep(1.0)  # its first HOLD is new; what comes after repeats it
        yield
    finally:
        sent, _ = process.communicate("", 60.0)
        rate = int(sent or 0)
        figures.check(rate > 0.8 * RATE, f"{clock}: the flood sent {rate} requests a second")


class Operator:
    """Asks on `flight/request` and notes when `flight/mode` shows it."""

    def __init__(self, node):
        entry = topics.TOPICS["flight/request"]
        self._requests = node.create_publisher(entry.type, entry.name, entry.qos())
        entry = topics.TOPICS["flight/mode"]
        node.create_subscription(entry.type, entry.name, self._on_mode, entry.qos(1))
        self.mode, self.seen = "", threading.Condition()

    def _on_mode(self, message: FlightMode):
        with self.seen:
            self.mode = message.name
            self.seen.notify_all()

    def ask(self, name, patience=10.0):
        """Ask for a mode and return after how many s it was shown, infinity if it never was."""
        began = time.monotonic()
        self._requests.publish(FlightRequest(request=getattr(FlightRequest, name), sender=f"operator {began}"))
        with self.seen:
            shown = self.seen.wait_for(lambda: self.mode == name, patience)
        return time.monotonic() - began if shown else float("inf")


def landings(figures, operator, name):
    """Return after how many s each of ``ROUNDS`` LAND was shown; each is followed by a HOLD."""
    found = []
    for _ in range(ROUNDS):
        found.append(operator.ask("LAND"))
        time.sleep(0.3)
        figures.check(operator.mode == "LAND", f"{name}: 0.3 s after LAND the mode is LAND")
        operator.ask("HOLD")
        time.sleep(0.6)  # a flood's HOLD within 0.5 s of a granted one is a repetition
    return found


def flown(figures, clock, is_flooded):
    """Fly one mission: LAND and HOLD in turn, then KILL; returns the delays of LAND, and that of KILL."""
    name = f"{clock}, {'with' if is_flooded else 'without'} a flood"
    out = figures.folder / name.replace(", ", "-").replace(" ", "-")
    flight = start("--mission", "takeoff:6,hold:600,land", *CLOCKS[clock], "--domain", str(DOMAIN), "--out", out)
    wait_until_flying(flight, out, IN_THE_AIR)
    with stranger(DOMAIN, "operator") as node:
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        operator = Operator(node)
        threading.Thread(target=executor.spin, daemon=True).start()
        wait_until(lambda: operator.mode == "HOLD", 60.0, "a hold in the air")
        with flooded(figures, clock) if is_flooded else contextlib.nullcontext():
            land = landings(figures, operator, name)
            kill = operator.ask("KILL")
        executor.shutdown()
    done = finish(flight)
    figures.check(done.returncode == 1 and "KILL" in done.stderr, f"{name}: exit code {done.returncode}, KILL named")
    shown = ", ".join(f"{1e3 * delay:.1f}" for delay in sorted(land))
    figures.show(f"{name}: LAND shown after {shown} ms, KILL after {1e3 * kill:.1f} ms")
    return land, kill


def run(figures):
    for clock in CLOCKS:
        (before, killed), (after, killed_late) = (flown(figures, clock, flag) for flag in (False, True))
        later = statistics.median(after) - statistics.median(before)
        figures.at_most(f"{clock}: LAND later by the flood, median of {ROUNDS}", later, LIMITS["LAND"], "s")
        figures.at_most(f"{clock}: KILL later by the flood", killed_late - killed, LIMITS["KILL"], "s")


if __name__ == "__main__":
    flood(int(sys.argv[1]))

"""A flood of valid requests, 1,000 a second: how much later LAND and KILL take effect; the flood takes nothing back."""

import statistics
import tempfile
import threading
import time
from pathlib import Path

import rclpy
from figures import Figures
from flying import bag_file, finish, start, stranger, wait_until, wait_until_flying
from rclpy.executors import SingleThreadedExecutor

from quad_msgs.msg import FlightMode, FlightRequest
from quad_node import topics

DOMAIN = 93
CLOCKS = {"lockstep": (), "realtime": ("--realtime",)}
RATE = 1000.0  # Hz
IN_THE_AIR = 1_500_000  # bytes of a bag whose vehicle is above 1 m
LIMITS = {"LAND": 0.050, "KILL": 0.020}  # s by which a flood may delay a request
ROUNDS = 7


class Operator:
    """Asks on `flight/request` and notes when `flight/mode` shows it; can flood at the same time."""

    def __init__(self, node):
        entry = topics.TOPICS["flight/request"]
        self._requests = node.create_publisher(entry.type, entry.name, entry.qos())
        entry = topics.TOPICS["flight/mode"]
        node.create_subscription(entry.type, entry.name, self._on_mode, entry.qos(1))
        self.mode, self.seen = "", threading.Condition()
        self.flooding = threading.Event()
        threading.Thread(target=self._flood, daemon=True).start()

    def _on_mode(self, message: FlightMode):
        with self.seen:
            self.mode = message.name
            self.seen.notify_all()

    def _flood(self):
        message = FlightRequest(request=FlightRequest.HOLD, sender="flood")
        while self.flooding.wait():
            due = time.monotonic()
            while self.flooding.is_set():
                self._requests.publish(message)
                due += 1.0 / RATE
                time.sleep(max(0.0, due - time.monotonic()))

    def ask(self, name, patience=10.0):
        """Ask for a mode and return after how many s it was shown, infinity if it never was."""
        began = time.monotonic()
        self._requests.publish(FlightRequest(request=getattr(FlightRequest, name), sender=f"operator {began}"))
        with self.seen:
            shown = self.seen.wait_for(lambda: self.mode == name, patience)
        return time.monotonic() - began if shown else float("inf")


def flown(figures, clock, folder):
    """Fly one mission: LAND and HOLD in turn without and with the flood, then KILL in it."""
    out = Path(folder, clock)
    flight = start("--mission", "takeoff:6,hold:600,land", *CLOCKS[clock], "--domain", str(DOMAIN), "--out", out)
    wait_until_flying(flight, out)
    wait_until(lambda: bag_file(out).stat().st_size > IN_THE_AIR, 120.0, "the vehicle is in the air")
    with stranger(DOMAIN, "operator") as node:
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        operator = Operator(node)
        threading.Thread(target=executor.spin, daemon=True).start()
        wait_until(lambda: operator.mode == "HOLD", 60.0, "a hold in the air")
        delays = {"without": [], "with": []}
        for kind, found in delays.items():
            (operator.flooding.set if kind == "with" else operator.flooding.clear)()
            time.sleep(1.0)
            for _ in range(ROUNDS):
                found.append(operator.ask("LAND"))
                time.sleep(0.3)
                figures.check(operator.mode == "LAND", f"{clock}, {kind} a flood: 0.3 s after LAND the mode is LAND")
                operator.ask("HOLD")
                time.sleep(0.2)
        before, after = (statistics.median(found) for found in delays.values())
        most = max(delays["with"])
        figures.at_most(f"{clock}: LAND later by the flood, median of {ROUNDS}", after - before, LIMITS["LAND"], "s")
        shown = f"{1e3 * before:.1f} ms, in the flood {1e3 * after:.1f}, most {1e3 * most:.1f}"
        print(f"     {clock}: LAND shown after {shown}")
        figures.at_most(
            f"{clock}: KILL in the flood against LAND without", operator.ask("KILL") - before, LIMITS["KILL"], "s"
        )
        operator.flooding.clear()
        executor.shutdown()
    done = finish(flight)
    figures.check(done.returncode == 1 and "KILL" in done.stderr, f"{clock}: exit code {done.returncode}, KILL named")


def main():
    figures = Figures()
    with tempfile.TemporaryDirectory(prefix="request-flood-") as folder:
        for clock in CLOCKS:
            flown(figures, clock, folder)
    rclpy.try_shutdown()
    return figures.code()

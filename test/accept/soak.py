"""Hours of flying in real time at 500 Hz under load: memory and messages."""

import re
import time
from pathlib import Path

import numpy as np
from flying import ROLES, busy_loops, finish, last_word, node_pids, start, wait_until_flying

from quad_flight_log.reader import open_flight

FLAT = 1024.0  # kB after the first minute
INDEX = 10.0  # kB/s that the recorder may grow by: mcap keeps the index of every chunk, 1.4 kB, until the end
EVERY = 5.0  # s between two looks at the memory
PERIOD = 2_000_000  # ns
PLANT = ("state", "truth", "disturbance", "actuation")


def memory(pids):
    """Return {role: resident kB} of processes that still run."""
    found = {}
    for role, pid in pids.items():
        status = Path(f"/proc/{pid}/status")
        match = re.search(r"VmRSS:\s+(\d+)", status.read_text()) if status.exists() else None
        if match:
            found[role] = int(match[1])
    return found


def run(figures):
    duration, out, samples = figures.seconds(3600.0), figures.folder / "bag", []
    with busy_loops(2, duration + 60.0):
        words = ("hover", "--realtime", "--duration", str(duration), "--limits", "position_max=5", "--out", out)
        flight = start(*words)
        wait_until_flying(flight, out)
        began = time.monotonic()
        while flight.poll() is None and time.monotonic() - began < duration - EVERY:
            time.sleep(EVERY)
            samples.append((time.monotonic() - began, memory(node_pids(flight.pid))))
        done = finish(flight, duration + 120.0)
    said = "" if done.returncode == 0 else done.stderr.strip()[-300:]
    figures.check(
        done.returncode == 0, f"{duration:.0f} s in real time beside load: exit code {done.returncode} {said}"
    )
    settled = min(60.0, duration / 3)
    for role in ROLES:
        sizes = [(when, sizes[role]) for when, sizes in samples if when >= settled and role in sizes]
        if sizes:
            growth = np.median([size for _, size in sizes[-3:]]) - sizes[0][1]
            limit = FLAT + INDEX * (sizes[-1][0] - sizes[0][0]) * (role == "recorder")
            figures.at_most(f"{role}: growth after {settled:.0f} s, from {sizes[0][1]} kB", growth, limit, "kB")
    bag = open_flight(out)
    late = last_word(bag, "simulator", "overruns")
    for topic in PLANT:
        stamps = np.unique(bag.array(topic)["stamp_ns"])
        missing = int(stamps[-1]) // PERIOD + 1 - len(stamps)
        lost = int(bag.metadata.get(f"missing.{topic}", "0"))
        figures.at_most(f"{topic}: messages lost", lost, 0)
        figures.at_most(f"{topic}: of {len(stamps)} steps missing, skipped by the plant", missing, late)

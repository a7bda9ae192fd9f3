"""Flights with ``--view`` and two browsers beside flights without, in turn: what the feeder takes, what is missed.

Five processes, in lockstep and at 500 Hz in real time. One browser is killed in flight, the other reads to the end.
Browsers are readers of the page's stream: drawing is measured in a browser, not here.
"""

import os
import re
import signal
import statistics
import subprocess
import sys
import time
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from flying import children, finish, start
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message

FEEDER = 5.0  # % of a core
MORE_MISSED = 0.2  # % of the steps
WATCHED = 8.0  # s on the wall until one browser is killed
KINDS = {
    "lockstep": ("--duration", "40"),
    "500 Hz": ("--duration", "20", "--realtime", "--set", "flight.plant_period=2000000"),
}
BROWSER = """
import sys, urllib.request
with urllib.request.urlopen(sys.argv[1] + "events", timeout=60) as stream:
    for line in stream:
        if line.startswith((b"id:", b"event: end")):
            print(line.decode().strip(), flush=True)
"""


def cpu(pid):
    """Return the CPU time of a process, in s."""
    words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def missed(bag):
    """Return how many commands the simulator counted as missed: none in lockstep, which waits for each."""
    found = 0
    with next(bag.glob("*.mcap")).open("rb") as stream:
        for _, _, message in make_reader(stream).iter_messages(["/diagnostics"]):
            for status in deserialize_message(message.data, DiagnosticArray).status:
                found = next((int(pair.value) for pair in status.values if pair.key == "missed_commands"), found)
    return found


def watched(flight):
    """Watch a flight with two browsers and kill one; return % of a core of the feeder, and what the other read last."""
    address = next(found[0] for line in flight.stdout if (found := re.search(r"http://\S+/", line)))
    browsers = [
        subprocess.Popen([sys.executable, "-c", BROWSER, address], stdout=subprocess.PIPE, text=True) for _ in range(2)
    ]
    assert all(browser.stdout.readline().startswith("id:") for browser in browsers)
    words = {pid: Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0") for pid in children(flight.pid)}
    feeder = next(pid for pid, line in words.items() if b"--live" in line)
    begin, spent = time.monotonic(), cpu(feeder)
    time.sleep(WATCHED)
    share = 100.0 * (cpu(feeder) - spent) / (time.monotonic() - begin)
    os.kill(browsers[0].pid, signal.SIGKILL)
    read, _ = browsers[1].communicate(timeout=300)
    browsers[0].communicate()
    return share, read.split("\n")[-2]


def flown(out, *arguments):
    """Fly; return (x real time, missed commands, % of a core of the feeder, what a browser read last)."""
    flight = start("hover", *arguments, "--out", out)
    share, last = watched(flight) if "--view" in arguments else (0.0, "event: end")
    done = finish(flight, 300)
    assert done.returncode == 0, done.stdout + done.stderr
    pace = re.search(r"at ([\d.]+) x real time", done.stdout + done.stderr)
    return float(pace[1]), missed(out), share, last


def paired(figures, kind):
    """Fly a kind without and with a view in turn; return what was found of each."""
    alone, seen = [], []
    for number in range(figures.each(5)):
        for view in ((), ("--view",))[:: 1 if number % 2 else -1]:
            out = figures.folder / f"{kind}{number}{len(view)}"
            (seen if view else alone).append(flown(out, *KINDS[kind], *view))
    return alone, seen


def run(figures):
    for kind in filter(figures.wants, KINDS):
        alone, seen = paired(figures, kind)
        figures.check(all(each[3] == "event: end" for each in seen), f"{kind}: one killed, the other read to the end")
        figures.at_most(f"{kind}: feeder of two browsers", max(each[2] for each in seen), FEEDER, "% of a core")
        if kind == "lockstep":
            without, viewed = (statistics.median(each[0] for each in rows) for rows in (alone, seen))
            figures.show(f"{kind}: {viewed:g} x real time, {without:g} without a view")
        else:
            without, viewed = (100.0 * sum(each[1] for each in rows) / (10_000 * len(rows)) for rows in (alone, seen))
            figures.at_most(f"{kind}: missed, {without:.3g} % without a view", viewed, without + MORE_MISSED, "%")

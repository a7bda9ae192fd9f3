"""100 SIGINTs at random moments, five processes and one, both clocks: bag closed, reason, exit code, nothing left."""

import random
import shutil
import signal
import subprocess
import time

from figures import Figures, seconds
from flying import ROOT, finish
from rooms import room

from quad_flight_log.bag.reader import open_flight
from quad_flight_log.errors import FlightLogError

COUNT = 100
MODES = [(), ("--one-process",), ("--realtime",), ("--one-process", "--realtime")]
NAME = "bag"


def interrupted(place, mode, early, delay):
    """Return (how a flight ended that got SIGINT ``delay`` s after its start, or after its bag grew; what is wrong)."""
    words = place.inside(ROOT / "scripts/fly", "hover", "--duration", "60", *mode, "--out", f"/tmp/{NAME}")
    pipe = subprocess.PIPE
    flight = subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
    out = place.path(f"/tmp/{NAME}")
    until = time.monotonic() + 90.0
    while not early and time.monotonic() < until and flight.poll() is None:
        if any(path.stat().st_size > 20_000 for path in out.glob("*.mcap*")):
            break
        time.sleep(0.05)
    time.sleep(delay)
    flight.send_signal(signal.SIGINT)
    done = finish(flight)
    wrong = list(problems(done, out, early))
    wrong += [f"left behind: {place.left_behind(NAME)}"] if place.left_behind(NAME) else []
    shutil.rmtree(out, ignore_errors=True)
    return wrong


def problems(done, out, early):
    """Yield what is wrong with an interrupted flight."""
    if done.returncode != 1:
        yield f"exit code {done.returncode}: {done.stderr[-300:]}"
    if "Traceback" in done.stderr or done.stderr.count("interrupted") != 1:
        yield f"said {done.stderr[-300:]!r}"
    if not out.exists():
        if not early:
            yield "no bag"
        return
    try:
        bag = open_flight(out)
    except FlightLogError as error:
        yield str(error)
        return
    reason = bag.metadata.get("reason", "")
    if bag.truncated or bag.metadata.get("outcome") != "failed":
        yield f"truncated {bag.truncated}, outcome {bag.metadata.get('outcome')}: {bag.damage}"
    if "SIGINT" not in reason and not early:
        yield f"reason {reason!r}"


def main():
    figures, draw = Figures(), random.Random(time.time_ns())
    until, number, bad = time.monotonic() + seconds(7200.0), 0, 0
    with room() as place:
        while number < COUNT and time.monotonic() < until:
            mode, early = MODES[number % len(MODES)], draw.random() < 0.3
            delay = draw.uniform(0.5, 6.0) if early else draw.uniform(0.0, 4.0)
            wrong = interrupted(place, mode, early, delay)
            bad += bool(wrong)
            for text in wrong:
                when = f"{delay:.2f} s after {'its start' if early else 'the bag grew'}"
                figures.check(False, f"{' '.join(mode) or 'five processes'}, {when}: {text}")
            number += 1
    figures.check(bad == 0, f"{number} SIGINTs, half of them to one process: {bad} that ended badly, 0 wanted")
    return figures.code()

"""A fake vehicle as a process beside a test: PROGRAM PORT REPORT '{"option": value}', until SIGTERM."""

import json
import signal
import sys
import time
from pathlib import Path

STEP = 0.004  # s


def fly(turn, is_done):
    """Call ``turn`` every STEP until ``is_done``; where the machine is late, this clock waits."""
    began, steps = time.monotonic(), 0
    while not is_done():
        began = max(began, time.monotonic() - STEP * (steps + 6))
        while began + STEP * steps <= time.monotonic():
            turn()
            steps += 1
        time.sleep(max(0.0, began + STEP * steps - time.monotonic()))


def serve(kind):
    """Fly one fake of ``kind`` as the command line says and write its report."""
    done = []
    for name in (signal.SIGTERM, signal.SIGINT):
        signal.signal(name, lambda *_: done.append(1))
    fake = kind(int(sys.argv[1]), json.loads(sys.argv[3]) if len(sys.argv) > 3 else {})
    print("up", flush=True)
    fly(fake.turn, lambda: bool(done))
    Path(sys.argv[2]).write_text(json.dumps({**fake.report, "ended": round(fake.now, 3)}), encoding="utf-8")

"""What people bring on their first day: each case as a command, its exit code, the line expected, and what was before.

The cases are those of public reports (C) and of a new ROS user's day (F); each kind has further members. Rows are
commands as a user types them or flights on a faulty estimator (``estimators``). ``--only PATTERN`` takes rows whose
name holds it, such as ``--only "^C1"`` or ``--only "hover.*100"``. What tests of the suite reproduce is run there: C0
test_infeasible; C8 test_waypoints; C10 test_files; C11 to C15, C20, C22 test_bags_of_others; C16, C18, C19, C21, F17
test_fly_usage; C17 test_parameter_files; C23 test_same_bits; F1 test_topics; F3, F5 to F7 test_package_xml; F4
test_launch_file; F8, F11 test_report_browser; F9 test_steps; F16 test_fly_by_hand.
"""

import os
import re
import shlex
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from flying import ROOT

CRASH = "Traceback"
LONGEST = 400.0  # s


class Row(NamedTuple):
    """One case: its name, what was done, what happened before; and what happens now as (kept, words)."""

    name: str
    done: str
    before: str
    now: Callable[[Path], tuple[bool, str]]


ROWS: list[Row] = []


def typed(name, words, code, line, before, *, say="", settings=None, files=None, interrupt=0.0):
    """Add a command: it must end with ``code``, print ``line`` (an expression), and show no traceback.

    ``settings``: environment; ``files``: {name: text} in the folder it runs in; ``interrupt``: Ctrl-C after so many s.
    """

    def now(folder):
        for file, text in (files or {}).items():
            path = folder / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        surroundings = {**os.environ, **{key: value.format(folder=folder) for key, value in (settings or {}).items()}}
        command = [str(ROOT / word) if word.startswith("scripts/") else word for word in shlex.split(words)]
        process = subprocess.Popen(
            command, cwd=folder, env=surroundings, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        if interrupt:
            time.sleep(interrupt)
            process.send_signal(signal.SIGINT)
        try:
            out, _ = process.communicate(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            process.kill()
            return False, f"no end within {LONGEST:g} s"
        found = next((text for text in out.splitlines() if re.search(line, text)), "")
        ended = process.returncode if process.returncode >= 0 else 128 - process.returncode  # as a shell says it
        good = ended == code and bool(found or not line) and CRASH not in out
        shown = found or out.strip()[-160:] or "nothing printed"
        return good, f"exit {ended}: {shown.strip()[:220]}"

    shown = " ".join([*(f"{key}={value}" for key, value in (settings or {}).items()), words])
    ROWS.append(Row(name, say or shown, before, now))


WAYPOINTS = "scripts/fly waypoints --set trajectory.waypoints.points='{}'"

# The paper's own experiment
typed("C0 case2 printed", "scripts/fly case2 --start printed --duration 25 --limits position_max=20", 0, "case2: good",
      "failed, exit 1")  # fmt: skip

# Angles
typed("C7 degrees as radians", WAYPOINTS.format("0 0 2 0; 4 0 2 90"), 2, r"90.*(deg|2 pi)", "14 turns, 203 s, good")
typed("C7 hover.yaw=180", "scripts/fly hover --set trajectory.hover.yaw=180.0", 2, "hover.yaw", "flown")
typed("C7 90deg", "scripts/fly hover --duration 2 --set trajectory.hover.yaw=90deg", 0, "hover: good", "refused")
typed("C7 a goto of 90", "scripts/fly --mission takeoff:1,goto:1:0:1:90,land", 2, r"90.*(deg|2 pi)", "no goto")
typed("C7 an angle in words", "scripts/fly hover --set trajectory.hover.yaw=90degrees", 2, "yaw: found '90degrees'", "")

# Bags of others
typed("C10 a text file named .mcap", "scripts/log info b/x.mcap", 2, r"x\.mcap", "", files={"b/x.mcap": "hello"})
typed("C10 a folder without a bag", "scripts/log info b", 2, "b: .*mcap", "no *.mcap", files={"b/notes.txt": "hello"})
typed("C10 a database that is none", "scripts/log info b", 2, "db3", "", files={"b/x.db3": "hello"})
typed("C20 no bag", "scripts/log metrics none", 2, "none", "")

# Surroundings
VEHICLE = "/**:\n  ros__parameters:\n    vehicle:\n      mass: {}\n"
for text in ("6e-1", "0.6", "+.6"):
    typed(f"C17 mass: {text}", "scripts/fly hover --duration 1 --vehicle v.yaml", 0, "hover: good",
          "refused what nodes take", files={"v.yaml": VEHICLE.format(text)})  # fmt: skip
typed("C17 a section that reaches nobody", "scripts/fly hover --duration 1 --vehicle v.yaml", 2, "simulater",
      "dropped in silence", files={"v.yaml": VEHICLE.format(0.6).replace("/**", "simulater")})  # fmt: skip
typed("C18 log folder", "scripts/fly hover --duration 1", 0, "hover: good", "is /dev/shm full?",
      settings={"ROS_LOG_DIR": "/proc/none"})  # fmt: skip
typed("C18 domain", "scripts/fly hover --duration 1", 2, "ROS_DOMAIN_ID", "", settings={"ROS_DOMAIN_ID": "300"})
typed("C18 no discovery", "scripts/fly hover --duration 1", 2, "ROS_AUTOMATIC_DISCOVERY_RANGE", "waited without end",
      settings={"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"})  # fmt: skip
typed("C23 case2, 10 ms", "scripts/fly case2 --duration 20 --set simulator.sensor.delay=0.01 --limits "
      "position_rmse=0.012", 0, "case2: good", "53.9 mm")  # fmt: skip
typed("C21 a trajectory that is not flown", "scripts/fly hover --set trajectory.case1.radius=2", 2, "case1.radius", "")
typed("C23 hover, 20 ms", "scripts/fly hover --duration 5 --set simulator.sensor.delay=0.02", 0, "hover: good", "fell")

# A new ROS user's day
typed("F2 Ctrl-C of a mission", "scripts/fly --mission takeoff:3,hold:60,land --realtime", 1,
      r"second signal .* stops the motors", "silent; a second one dropped the vehicle", interrupt=15.0)  # fmt: skip
typed(
    "F10 a campaign says what it does", "scripts/campaign campaign_case2 --flights 20 --out c", 0, "", "0 % for 152 s"
)
typed("F12 export without --out", "scripts/log export --help", 0, "--out", "'default: only print', but it wrote")
FLOWN = f"{ROOT}/scripts/fly hover --duration 5 --out b > /dev/null && timeout --preserve-status -s INT 0.6"
for verb in ("replay", "export", "report"):
    typed(f"F13 Ctrl-C in log {verb}", f"bash -c '{FLOWN} {ROOT}/scripts/log {verb} b'", 130, "", "10 to 25 lines")
typed("F13 Ctrl-C in campaign", "scripts/campaign campaign_case2 --flights 2000 --out c", 130, "", "traceback",
      interrupt=12.0)  # fmt: skip
for program, words in (("campaign", "campaign_case2 --out c"), ("tune", "paper --out t"), ("study", "paper --out s")):
    typed(f"F13 Ctrl-C while {program} imports", f"scripts/{program} {words}", 130, "", "traceback", interrupt=1.0)
typed("F13 tune of no file", "scripts/tune none.yaml", 2, "none.yaml", "traceback")
for display in ("", ":99"):
    typed(f"F14 log view with DISPLAY={display}", "scripts/log view --live", 2, "no flight is under way", "exit 0",
          settings={"DISPLAY": display, "WAYLAND_DISPLAY": ""})  # fmt: skip
typed("F15 scripts/docs --check", "scripts/docs --check", 0, "", "5 pages not up to date with own plug-ins installed")
AGAIN = f"{ROOT}/scripts/fly hover --duration 1 --out b"
typed("F16 a bag that exists", f"bash -c '{AGAIN}; {AGAIN}'", 2, "--out: b exists", "11 s of silence")
typed("F17 two limits", "scripts/fly hover --duration 1 --limits position_max=1 --limits position_rmse=1", 0,
      "hover: good", "")  # fmt: skip
typed("F17 campaign of an unknown file", "scripts/campaign nosuch --out c", 2, "nosuch", "")


def run(figures):
    for number, row in enumerate(row for row in ROWS if figures.wants(row.name)):
        folder = figures.folder / str(number)
        folder.mkdir()
        kept, now = row.now(folder)
        figures.check(kept, f"{row.name} | {row.done} | before: {row.before or 'the same'} | now: {now}")

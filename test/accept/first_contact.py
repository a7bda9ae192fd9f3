"""What people bring on their first day: each case as a command, its exit code, the line expected, and what was before.

The cases are those of public reports (C) and of a new ROS user's day (F); each kind has further members. Rows are
commands as a user types them, tests of the suite, or flights on a faulty estimator (``estimators``). ``--only PATTERN``
takes rows whose name holds it, such as ``--only "^C1"`` or ``--only "hover.*100"``.
"""

import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from estimators import fly_mistakes, fly_streams
from flying import ROOT

CRASH = "Traceback"
LONGEST = 400.0  # s
LOG, BRINGUP, CORE = "src/quad_flight_log/test", "src/quad_bringup/test", "src/quad_core/test"


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


def proven(name, done, before, *tests):
    """Add a case that ``tests`` of the suite reproduce."""

    def now(_folder):
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "0", *tests]
        ended = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
        last = (ended.stdout.strip() or ended.stderr.strip()).splitlines()[-1][-160:]
        return ended.returncode == 0, f"exit {ended.returncode}: {last}"

    ROWS.append(Row(name, f"{done} ({', '.join(tests)})", before, now))


WAYPOINTS = "scripts/fly waypoints --set trajectory.waypoints.points='{}'"

# The paper's own experiment
proven(
    "C0 printed start, both cases, tuned and minimal",
    "step of 6 to 13 m at the start",
    "failed: the reference asked for more than the vehicle has",
    "src/quad_flight/test/test_infeasible.py",
)
typed("C0 case2 printed", "scripts/fly case2 --start printed --duration 25 --limits position_max=20", 0, "case2: good",
      "failed, exit 1")  # fmt: skip

# Angles
typed("C7 degrees as radians", WAYPOINTS.format("0 0 2 0; 4 0 2 90"), 2, r"90.*(deg|2 pi)", "14 turns, 203 s, good")
typed("C7 hover.yaw=180", "scripts/fly hover --set trajectory.hover.yaw=180.0", 2, "hover.yaw", "flown")
typed("C7 90deg", "scripts/fly hover --duration 2 --set trajectory.hover.yaw=90deg", 0, "hover: good", "refused")
typed("C7 a goto of 90", "scripts/fly --mission takeoff:1,goto:1:0:1:90,land", 2, r"90.*(deg|2 pi)", "no goto")
typed(
    "C7 an angle in words",
    "scripts/fly hover --set trajectory.hover.yaw=90degrees",
    2,
    "hover.yaw: found '90degrees'",
    "",
)
proven("C8 3.1 to -3.1 rad", "short way round, the long one said", "6.2 rad the long way",
       "src/quad_trajectory/test/test_waypoint_text.py", "src/quad_trajectory/test/test_waypoints.py")  # fmt: skip

# Bags of others
proven("C10 split, compressed, sqlite", "rosbag2's kinds, read or named", "refused, or 'no *.mcap'",
       f"{LOG}/test_files.py")  # fmt: skip
proven("C11 C12 C13 C14 C15 C20 C22", "encodings, names, definitions, padding, two vehicles, losses, no flight, ascii",
       "stopped at the first topic; refused; 20 times n/a; 'ok' with 72 steps missing; equal; UnicodeEncodeError",
       f"{LOG}/test_bags_of_others.py")  # fmt: skip
typed("C10 a text file named .mcap", "scripts/log info b/x.mcap", 2, r"x\.mcap", "", files={"b/x.mcap": "hello"})
typed("C10 a folder without a bag", "scripts/log info b", 2, "b: .*mcap", "no *.mcap", files={"b/notes.txt": "hello"})
typed("C10 a database that is none", "scripts/log info b", 2, "db3", "", files={"b/x.db3": "hello"})
typed("C20 no bag", "scripts/log metrics none", 2, "none", "")

# Surroundings
proven("C16 C18 C19 C21 F17 what lets nothing fly", "named in one line, exit code 2",
       "rcl's raw line, exit 102; waited without end; traceback; good, exit 0", "test/test_fly_usage.py")  # fmt: skip
VEHICLE = "/**:\n  ros__parameters:\n    vehicle:\n      mass: {}\n"
for text in ("6e-1", "0.6", "+.6"):
    typed(f"C17 mass: {text}", "scripts/fly hover --duration 1 --vehicle v.yaml", 0, "hover: good",
          "refused what nodes take", files={"v.yaml": VEHICLE.format(text)})  # fmt: skip
typed("C17 a section that reaches nobody", "scripts/fly hover --duration 1 --vehicle v.yaml", 2, "simulater",
      "dropped in silence", files={"v.yaml": VEHICLE.format(0.6).replace("/**", "simulater")})  # fmt: skip
proven("C17 one reading", "files as rclpy reads them", "fly, nodes and Python differed",
       f"{CORE}/test_parameter_files.py")  # fmt: skip
typed("C18 log folder", "scripts/fly hover --duration 1", 0, "hover: good", "is /dev/shm full?",
      settings={"ROS_LOG_DIR": "/proc/none"})  # fmt: skip
typed("C18 domain", "scripts/fly hover --duration 1", 2, "ROS_DOMAIN_ID", "", settings={"ROS_DOMAIN_ID": "300"})
typed("C18 no discovery", "scripts/fly hover --duration 1", 2, "ROS_AUTOMATIC_DISCOVERY_RANGE", "waited without end",
      settings={"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"})  # fmt: skip
proven("C23 10 ms of delay, nothing set", "prediction by the state's age", "53.9 mm",
       "test/test_same_bits.py::test_ros_flight_has_the_bits_of_the_flight_without_ros_and_replays")  # fmt: skip
typed("C23 case2, 10 ms", "scripts/fly case2 --duration 20 --set simulator.sensor.delay=0.01 --limits "
      "position_rmse=0.012", 0, "case2: good", "53.9 mm")  # fmt: skip
typed("C21 a trajectory that is not flown", "scripts/fly hover --set trajectory.case1.radius=2", 2, "case1.radius", "")
typed("C23 hover, 20 ms", "scripts/fly hover --duration 5 --set simulator.sensor.delay=0.02", 0, "hover: good", "fell")

# A new ROS user's day
proven("F1 latched mode", "the newest mode", "18 to 20 s old", "src/quad_node/test/test_topics_table.py")
typed("F2 Ctrl-C of a mission", "scripts/fly --mission takeoff:3,hold:60,land --realtime", 1,
      r"second signal .* stops the motors", "silent; a second one dropped the vehicle", interrupt=15.0)  # fmt: skip
proven("F3 F5 F6 F7", "dependencies, rosdep keys, COLCON_IGNORE, colcon test", "four errors",
       "test/test_package_xml.py")  # fmt: skip
proven("F4 ros2 launch", "exit codes 0, 1, 2", "success of anything", f"{BRINGUP}/test_launch_file.py")
proven("F8 F11 pages in a browser", "drawn whole, labels apart", "half of it blank; labels on each other",
       f"{LOG}/test_report_browser.py")  # fmt: skip
proven("F9 missing steps", "losses only", "a pause counted", f"{LOG}/test_arrays.py", f"{LOG}/test_steps.py")
typed(
    "F10 a campaign says what it does", "scripts/campaign campaign_case2 --flights 20 --out c", 0, "", "0 % for 152 s"
)
typed("F12 export without --out", "scripts/log export --help", 0, "--out", "'default: only print', but it wrote")
FLOWN = f"{ROOT}/scripts/fly hover --duration 5 --out b > /dev/null && timeout --preserve-status -s INT 1"
for verb in ("replay", "export", "report"):
    typed(f"F13 Ctrl-C in log {verb}", f"bash -c '{FLOWN} {ROOT}/scripts/log {verb} b'", 130, "", "10 to 25 lines")
typed(
    "F13 Ctrl-C in campaign",
    "scripts/campaign campaign_case2 --flights 2000 --out c",
    130,
    "",
    "traceback",
    interrupt=12.0,
)
for program, words in (("campaign", "campaign_case2 --out c"), ("tune", "paper --out t"), ("study", "paper --out s")):
    typed(f"F13 Ctrl-C while {program} imports", f"scripts/{program} {words}", 130, "", "traceback", interrupt=1.0)
typed("F13 tune of no file", "scripts/tune none.yaml", 2, "none.yaml", "traceback")
for display in ("", ":99"):
    typed(f"F14 log view with DISPLAY={display}", "scripts/log view", 0, "flight.rviz", "an EventLoopError, exit 0",
          settings={"DISPLAY": display, "WAYLAND_DISPLAY": ""})  # fmt: skip
typed("F15 scripts/docs --check", "scripts/docs --check", 0, "", "5 pages not up to date with own plug-ins installed")
proven("F16 fly_by_hand.sh", "again and again, unsourced", "worked once", "test/test_fly_by_hand.py")
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
    fly_streams(figures)
    fly_mistakes(figures)

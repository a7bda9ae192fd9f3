"""What a newcomer and a stranger tried: each finding reproduced, with what it did before and must do."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from findings import finding, reproduce
from flying import FLY as FLYER
from flying import ROOT, in_domain
from pythons import clean_environment
from rooms import room

FLY = ROOT / "scripts/fly"
QUICK = 10.0  # s for what is refused before anything is built, beside load


def ended(words, patience=180, **changes):
    """Run ``words``; returns exit code, stderr, seconds."""
    began = time.monotonic()
    done = subprocess.run(
        list(map(str, words)),
        env={**os.environ, **changes},
        capture_output=True,
        text=True,
        timeout=patience,
        check=False,
    )
    return done.returncode, done.stderr, time.monotonic() - began


def one_line(code, said, expected, *words):
    """Return whether a run ended with ``expected`` and one line with all ``words``; and what was seen."""
    good = code == expected and len(said.strip().splitlines()) == 1 and all(word in said for word in words)
    return good, f"exit code {code}: {said.strip()[-160:]}"


@finding("PYTHON=python9 scripts/setup", "ignored; PYTHON=python3.12 kept the .venv of 3.11")
def wrong_python(_folder):
    code, said, seconds = ended([ROOT / "scripts/setup"], PYTHON="python9")
    good, seen = one_line(code, said, 2, "python9")
    return good and seconds < QUICK, f"{seen} ({seconds:.1f} s)"


@finding("scripts/fly in a shell that has another checkout's environment", "CMake error after 109 s without a hint")
def other_checkout(folder):
    install = folder / "other" / "install"
    (install / "quad_core").mkdir(parents=True)
    for name in ("env.bash", ".quad"):
        (install / name).touch()
    environment = {**clean_environment(), "AMENT_PREFIX_PATH": str(install / "quad_core")}
    began = time.monotonic()
    done = subprocess.run([FLY, "hover"], env=environment, capture_output=True, text=True, timeout=300, check=False)
    seconds = time.monotonic() - began
    good, seen = one_line(done.returncode, done.stderr, 2, str(folder / "other"))
    return good and seconds < QUICK, f"{seen} ({seconds:.1f} s)"


@finding("QUAD_CACHE_DIR in a folder that everybody writes", "its library ran as root")
def open_cache(folder):
    (folder / "cache").mkdir()
    (folder / "cache").chmod(0o777)
    code, said, _ = ended(
        [sys.executable, "-c", "from quad_flight.engine import cache_root; cache_root()"],
        QUAD_CACHE_DIR=str(folder / "cache"),
    )
    return code == 1 and "PermissionError" in said and "0777" in said, said.strip().splitlines()[-1]


@finding("XDG_CACHE_HOME=''", "compiled code in the working directory")
def empty_cache_home(folder):
    text = (
        "import os; os.environ.pop('QUAD_CACHE_DIR', 0); from quad_flight.engine import cache_root; print(cache_root())"
    )
    environment = {**os.environ, "XDG_CACHE_HOME": "", "HOME": str(folder)}
    done = subprocess.run(
        [sys.executable, "-c", text], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    return done.stdout.strip() == str(folder / ".cache/quad_campaign"), done.stdout.strip()


@finding("a link where the lock of a domain is to be", "followed; anybody could hold all 101 locks")
def lock_link(folder):
    locks = folder / f"quad-{os.geteuid()}"
    if Path("/run/user", str(os.geteuid())).is_dir():
        return True, "this user has a session folder, where nobody else can put a link"
    locks.mkdir(mode=0o700)
    (locks / "domain-7.lock").symlink_to(folder / "victim")
    code, said, _ = ended([FLY, "hover", "--domain", "7", "--out", folder / "bag"], TMPDIR=str(folder))
    good, seen = one_line(code, said, 2, "domain-7.lock")
    return good and not (folder / "victim").exists(), seen


@finding('scripts/fly --namespace "a b"', "traceback")
def bad_namespace(folder):
    code, said, _ = ended([FLY, "hover", "--namespace", "a b", "--out", folder / "bag"])
    return one_line(code, said, 2, "a b")


@finding("HOME=/proc scripts/fly hover", "traceback")
def no_home(folder):
    code, said, _ = ended([FLY, "hover", "--duration", "0.2", "--out", folder / "bag"], HOME="/proc")
    lines = [line for line in said.splitlines() if "/proc" in line]
    return code == 0 and len(lines) == 1 and "Traceback" not in said, f"exit code {code}: {lines}"


@finding(
    "Ctrl-C within the first 3 s, 12 times", "4 of 7: traceback, exit code -2; at 2.5 s DIR was refused afterwards"
)
def early_interrupts(folder):
    draw, bad = random.Random(1), []
    for number in range(12):
        out, delay = folder / f"bag-{number}", draw.uniform(0.2, 3.0)
        pipe = subprocess.PIPE
        flight = subprocess.Popen(
            [FLY, "hover", "--duration", "60", "--out", out],
            stdout=pipe,
            stderr=pipe,
            text=True,
            start_new_session=True,
        )
        time.sleep(delay)
        os.killpg(flight.pid, signal.SIGINT)
        _, said = flight.communicate(timeout=60)
        left = out.exists() and not list(out.glob("*.mcap"))
        if flight.returncode != 1 or said.count("interrupted") != 1 or "Traceback" in said or left:
            bad.append(f"{delay:.2f} s: exit code {flight.returncode}, {said[-80:]!r}, left: {left}")
    return not bad, "; ".join(bad) or "exit code 1, one line, nothing left"


@finding("Ctrl-C again and again until scripts/fly has left", "exit code -15")
def interrupts_without_end(folder):
    flight = subprocess.Popen([FLY, "hover", "--duration", "60", "--out", folder / "bag"], stderr=subprocess.PIPE)
    time.sleep(5.0)
    while flight.poll() is None:
        flight.send_signal(signal.SIGINT)
        time.sleep(0.02)
    return flight.returncode == 1, f"exit code {flight.returncode}"


@finding("scripts/fly_by_hand.sh --help", 'flew case "--help"')
def help_by_hand(folder):
    done = subprocess.run([ROOT / "scripts/fly_by_hand.sh", "--help"], cwd=folder, capture_output=True, check=False)
    good = done.returncode == 0 and b"usage:" in done.stdout and not list(folder.iterdir())
    return good, f"exit code {done.returncode}"


@finding("scripts/fly in a domain where a flight is flown", "no word; one controller flew both vehicles, both exit 0")
def occupied_domain(folder):
    first = subprocess.Popen(
        [FLY, "hover", "--realtime", "--duration", "60", "--domain", "91", "--out", folder / "first"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        time.sleep(10.0)
        code, said, _ = ended([FLY, "hover", "--domain", "91", "--out", folder / "second"])
    finally:
        first.send_signal(signal.SIGINT)
        first.wait(60)
    return one_line(code, said, 2, "domain 91", "/simulator publishes state")


LOOK = """
import rclpy, time
rclpy.init()
node = rclpy.create_node("visitor")
time.sleep(3.0)
print(*node.get_node_names())
rclpy.try_shutdown()
"""


@finding("a shell without scripts/env.sh beside scripts/fly --visible", "saw 2 topics of 20; nothing said why")
def visible(folder):
    flight = subprocess.Popen(
        [FLY, "hover", "--realtime", "--duration", "60", "--visible", "--domain", "92", "--out", folder / "bag"],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    try:
        line = flight.stdout.readline()
        time.sleep(8.0)
        environment = {**in_domain(92), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        environment.pop("FASTDDS_BUILTIN_TRANSPORTS", None)
        done = subprocess.run(
            [sys.executable, "-c", LOOK], env=environment, capture_output=True, text=True, check=False
        )
    finally:
        flight.send_signal(signal.SIGINT)
        flight.wait(60)
    seen = set(done.stdout.split())
    return {"simulator", "recorder", "trajectory"} <= seen and "ROS_DOMAIN_ID=92" in line, f"{line.strip()}: {seen}"


def in_room(place, *words):
    """Fly inside a room; returns exit code, stderr and what is left there beside the bag."""
    done = subprocess.run(place.inside(FLYER, *words), capture_output=True, text=True, timeout=300, check=False)
    return done.returncode, done.stderr, place.left_behind("bag")


@finding("/dev/shm full", "traceback")
def no_shared_memory(_folder):
    """A flight does not use it."""
    with room(shm="4k") as place:
        code, said, left = in_room(place, "hover", "--out", "/tmp/bag")
    return code == 0 and not left, f"exit code {code}: {said.strip()[-100:]} {left}"


@finding("a disk that fills up in flight", "exit 2, a Python list as message, not judged, temporary folder left")
def filling_disk(_folder):
    with room(tmp="9m") as place:
        code, said, left = in_room(place, "hover", "--duration", "60", "--out", "/tmp/bag")
    named = "No space left" in said and "Traceback" not in said and "[(" not in said
    return code == 1 and named and not left, f"exit code {code}: {said.strip()[-300:]} {left}"


@finding("a campaign without Numba", "traceback")
def no_numba(folder):
    text = (
        "import sys; sys.modules['numba'] = None; from quad_campaign.campaign_cli import main; "
        f"sys.exit(main(['campaign_case2', '--flights', '2', '--out', {str(folder / 'out')!r}]))"
    )
    code, said, _ = ended([sys.executable, "-c", text])
    return code == 1 and "need Numba" in said and "Traceback" not in said, f"exit code {code}: {said.strip()[-100:]}"


def main():
    code = reproduce()
    print("     Python 3.10 to 3.13: scripts/accept pythons")
    return code

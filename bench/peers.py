"""Our batch beside RotorPy, Crazyflow (CPU) and MuJoCo at 500 Hz in closed loop; the peers in their own environment."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from batch import campaign, rates
from table import Row, alternated, ratios

from quad_campaign.batch import Batch, fly_numbers

BENCH = "peers"
HERE = Path(__file__).resolve().parent
PEERS = HERE.parent / ".cache" / "peers"
_FLIGHTS = 80


class Peer(NamedTuple):
    """One peer: its script with arguments, whether it lives in the peers' environment, how its job differs from ours.

    ``worlds`` is the count at which it was quickest on two cores, of those tried.
    """

    name: str
    script: str
    steps: int
    worlds: int
    apart: bool
    target: str
    note: str
    more: tuple[str, ...] = ()
    environment: tuple[tuple[str, str], ...] = ()


_DOUBLE = (("JAX_ENABLE_X64", "1"),)
_CRAZYFLOW = "motors; Mellinger control; 65536 worlds"
_EULER = f"its default, one derivative a step instead of four; {_CRAZYFLOW}"
ALL = (
    Peer("rotorpy", "rotorpy", 2000, 1, True, ">= 1000", "adaptive RK45, motors; geometric control"),
    Peer("rotorpy batched", "rotorpy_batched", 300_000, 10_000, True, ">= 50", "RK4, motors; geometric; 10000 worlds"),
    Peer("crazyflow RK4 float64", "crazyflow", 4_000_000, 65_536, True, "> 1", _CRAZYFLOW, ("rk4",), _DOUBLE),
    Peer("crazyflow RK4 float32", "crazyflow", 6_000_000, 65_536, True, "> 1", _CRAZYFLOW, ("rk4",)),
    Peer("crazyflow Euler float64", "crazyflow", 4_000_000, 65_536, True, "", _EULER, ("euler",), _DOUBLE),
    Peer("crazyflow Euler float32", "crazyflow", 6_000_000, 65_536, True, "", _EULER, ("euler",)),
    Peer("mujoco", "mujoco", 20_000, 1, False, "> 1", "RK4; our laws as plain Python"),
)


def measure(rounds: int) -> list[Row]:
    """Return steps per second of wall time of each peer and of our batch, both with all cores, in turn, and ratios."""
    problem = installed()
    batch = campaign()
    fly_numbers(batch, [0])
    rows = []
    for peer in ALL:
        if peer.apart and problem:
            rows.append(Row(BENCH, peer.name, (), "steps/s", "", problem))
        else:
            rows += _pair(peer, batch, rounds)
    return rows


def _pair(peer: Peer, batch: Batch, rounds: int) -> list[Row]:
    versions: list[str] = []

    def theirs() -> float:
        answer = run(peer)
        versions.append(str(answer["version"]))
        return float(answer["steps"]) / float(answer["wall"])

    measures: list[Callable[[], float]] = [theirs, lambda: rates(batch, _FLIGHTS, os.cpu_count() or 1)[0]]
    try:
        their_rates, our_rates = alternated(rounds, measures)
    except subprocess.CalledProcessError as error:
        last = (error.stderr or "failed").strip().splitlines()[-1]
        return [Row(BENCH, peer.name, (), "steps/s", "", f"could not run: {last[:80]}")]
    return [
        Row(BENCH, f"{peer.name} {versions[0]}", tuple(their_rates), "steps/s", "", peer.note),
        Row(BENCH, f"batch beside {peer.name}", tuple(our_rates), "steps/s", "", "float64, RK4, both laws in full"),
        Row(BENCH, f"batch over {peer.name}", ratios(our_rates, their_rates), "", peer.target),
    ]


def run(peer: Peer) -> dict[str, float | str]:
    """Return what a peer's script says of itself."""
    python = str(PEERS / "bin" / "python") if peer.apart else sys.executable
    inherited = {key: value for key, value in os.environ.items() if not peer.apart or not key.startswith("PYTHON")}
    words = [python, str(HERE / f"peer_{peer.script}.py"), str(peer.steps), str(peer.worlds), *peer.more]
    environment = {**inherited, **dict(peer.environment)}
    place = PEERS if peer.apart else HERE.parent  # MuJoCo leaves a log where it runs
    done = subprocess.run(words, capture_output=True, text=True, check=True, env=environment, timeout=600, cwd=place)
    found: dict[str, float | str] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def installed() -> str:
    """Make the peers' environment if it is not there; returns why it cannot be, empty if it is."""
    pinned = HERE / "peers-requirements.txt"
    mark = PEERS / ".installed"
    if mark.exists() and mark.read_text("utf-8") == pinned.read_text("utf-8"):
        return ""
    sys.stderr.write("bench: installing the peers into .cache/peers (2.5 GB) ...\n")
    # the oldest Python that all of them support, for PyTorch's wheels come late to new ones
    python = shutil.which("python3.11") or sys.executable
    steps = (
        [python, "-m", "venv", "--clear", str(PEERS)],
        [str(PEERS / "bin" / "pip"), "install", "-q", "-r", str(pinned)],
    )
    inherited = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    for words in steps:
        done = subprocess.run(words, capture_output=True, text=True, check=False, env=inherited)
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            return f"could not be installed: {last[:80]}"
    mark.write_text(pinned.read_text("utf-8"), "utf-8")
    return ""

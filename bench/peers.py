"""Our batch beside RotorPy, Crazyflow (CPU) and MuJoCo at 500 Hz in closed loop; the peers in their own environment."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from batch import campaign, rates
from table import Row

from quad_campaign.batch import fly_numbers

BENCH = "peers"
HERE = Path(__file__).resolve().parent
PEERS = HERE.parent / ".cache" / "peers"


class Peer(NamedTuple):
    """One script: how many steps it is asked for, whether it lives in the peers' environment, how its job differs."""

    name: str
    steps: int
    apart: bool
    note: str


ALL = (
    Peer("rotorpy", 2000, True, "adaptive RK45, motors; geometric control; one core"),
    Peer("crazyflow", 2_000_000, True, "float32, motors; Mellinger control; 1024 worlds, all cores"),
    Peer("mujoco", 20_000, False, "RK4; our laws as plain Python; one core"),
)


def measure(rounds: int) -> list[Row]:
    """Return steps per CPU second of each peer and of our batch in turn, and ratios of pairs."""
    problem = installed()
    batch = campaign()
    fly_numbers(batch, [0])
    rows = []
    for peer in ALL:
        if peer.apart and problem:
            rows.append(Row(BENCH, peer.name, (), "steps/CPU s", "", problem))
            continue
        theirs, ours = [], []
        try:
            for _ in range(rounds):
                told = run(peer)
                theirs.append(told["steps"] / told["cpu"])
                ours.append(rates(batch, 16, 1)[1])
        except subprocess.CalledProcessError as error:
            last = (error.stderr or "failed").strip().splitlines()[-1]
            rows.append(Row(BENCH, peer.name, (), "steps/CPU s", "", f"could not run: {last[:80]}"))
            continue
        name = f"{peer.name} {told['version']}"
        over = tuple(mine / other for mine, other in zip(ours, theirs, strict=True))
        rows.append(Row(BENCH, name, tuple(theirs), "steps/CPU s", "", peer.note))
        rows.append(Row(BENCH, f"batch beside {peer.name}", tuple(ours), "steps/CPU s", "", "float64, RK4, full laws"))
        rows.append(Row(BENCH, f"batch over {peer.name}", over, "", {"rotorpy": ">= 1000"}.get(peer.name, "> 1")))
    rows.append(
        Row(BENCH, "rotorpy, batched", (), "steps/CPU s", "", "not measured: needs PyTorch, which is not pinned")
    )
    return rows


def run(peer: Peer) -> dict[str, float]:
    """Return what a peer's script says of itself."""
    python = str(PEERS / "bin" / "python") if peer.apart else sys.executable
    told = {key: value for key, value in os.environ.items() if not peer.apart or not key.startswith("PYTHON")}
    script = HERE / f"peer_{peer.name}.py"
    done = subprocess.run(
        [python, str(script), str(peer.steps)], capture_output=True, text=True, check=True, env=told, timeout=600
    )
    found: dict[str, float] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def installed() -> str:
    """Make the peers' environment if it is not there; returns why it cannot be, empty if it is."""
    wanted = HERE / "peers-requirements.txt"
    mark = PEERS / ".installed"
    if mark.exists() and mark.read_text("utf-8") == wanted.read_text("utf-8"):
        return ""
    sys.stderr.write("bench: installing the peers into .cache/peers ...\n")
    steps = (
        [sys.executable, "-m", "venv", str(PEERS)],
        [str(PEERS / "bin" / "pip"), "install", "-q", "-r", str(wanted)],
    )
    for words in steps:
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            return f"could not be installed: {last[:80]}"
    mark.write_text(wanted.read_text("utf-8"), "utf-8")
    return ""

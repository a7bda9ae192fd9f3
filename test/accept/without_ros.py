"""What needs no ROS, installed by pip into an environment of its own: a flight, compiled, and a bag read."""

import shutil
import subprocess
import sys
from pathlib import Path

from flying import fly as fly_nodes

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("core", "dynamics", "trajectory", "position_ctrl", "attitude_ctrl", "guard", "flight", "flight_log")
PROGRAM = """
import sys
from quad_flight.flight import fly, from_names
from quad_flight_log.reader import open_flight
flight = from_names("hover", duration=2.0)
plain, compiled = fly(flight), fly(flight, compiled=True)
print(plain.outcome, plain.topics["state"].tobytes() == compiled.topics["state"].tobytes(), plain.rmse)
print(len(open_flight(sys.argv[1]).array("state")))
try:
    import rclpy
except ImportError:
    print("no rclpy")
"""


def run(figures):
    bag = figures.folder / "bag"
    flown = fly_nodes("hover", "--duration", "2", "--out", bag)
    figures.check(flown.returncode == 0, "a flight of the nodes, for its bag")
    environment = figures.folder / "environment"
    subprocess.run([sys.executable, "-m", "venv", environment], check=True)
    python = environment / "bin" / "python"
    paths = [figures.folder / f"quad_{name}" for name in PACKAGES]
    for path in paths:  # pip builds where the package lies
        shutil.copytree(ROOT / "src" / path.name, path)
    subprocess.run(
        [python, "-m", "pip", "install", "-q", "--disable-pip-version-check", "numba", "scipy", *paths], check=True
    )
    clean = {"PATH": "/usr/bin:/bin", "HOME": str(figures.folder)}
    done = subprocess.run(
        [python, "-c", PROGRAM, bag], env=clean, cwd=figures.folder, capture_output=True, text=True, check=False
    )
    words = done.stdout.split()
    figures.check(words[:2] == ["ended", "True"], f"flown, plain and compiled to the same bits: {' '.join(words[:2])}")
    figures.check(words[3:4] and int(words[3]) > 1000, f"states read from the bag: {' '.join(words[3:4])}")
    figures.check(words[4:] == ["no", "rclpy"], "there is no ROS in that environment")
    if done.returncode:
        figures.show(done.stderr[-800:])

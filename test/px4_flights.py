"""The bridge beside the fake autopilot: messages of its own built once, processes, what came of it."""

import contextlib
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ament_index_python.packages import get_package_prefix
from flying import LONGEST, ROOT, executable, wait_until
from sockets import free_port
from vehicle_packages import vehicle_packages

from quad_bringup.domains import reserved_domain

HERE = Path(__file__).parent / "px4"
BRIDGE = Path(get_package_prefix("quad_px4"), "lib", "quad_px4", "px4_bridge")
PERIODS = ["-p", "flight.mode:=realtime", "-p", "flight.plant_period:=4000000"]
AIRFRAME = """
/**:
  ros__parameters:
    airframe:
      max_rotor_thrust: 8.549
      rotor0: {px: 0.174, py: 0.174, km: 0.016}
      rotor1: {px: -0.174, py: -0.174, km: 0.016}
      rotor2: {px: 0.174, py: -0.174, km: -0.016}
      rotor3: {px: -0.174, py: 0.174, km: -0.016}
"""
CONFIG = ROOT / "src/quad_flight/quad_flight/config"
VEHICLE, GAINS = CONFIG / "vehicles/x500.yaml", CONFIG / "controllers/x500.yaml"


def environment() -> dict[str, str]:
    """Return the environment in which px4_msgs is found; builds it where it lacks."""
    sources = [
        HERE / "px4_msgs/CMakeLists.txt",
        HERE / "px4_msgs/package.xml",
        *sorted(HERE.glob("px4_msgs/msg/*.msg")),
    ]
    key = hashlib.sha256(b"".join([sys.prefix.encode(), *(path.read_bytes() for path in sources)])).hexdigest()[:16]
    prefix = ROOT / ".cache" / f"px4_msgs-{key}"
    if not (prefix / "share/px4_msgs/package.xml").is_file():
        build(prefix)
    packages = next(prefix.glob("lib/python*/site-packages"))
    found = dict(os.environ)
    for name, path in (("AMENT_PREFIX_PATH", prefix), ("PYTHONPATH", packages), ("LD_LIBRARY_PATH", prefix / "lib")):
        found[name] = os.pathsep.join([str(path), *filter(None, [found.get(name)])])
    return found


def build(prefix: Path) -> None:
    """Build the messages into ``prefix``, all or nothing."""
    made = prefix.with_name(prefix.name + f".{os.getpid()}")
    wheels = "QUAD_ROS" not in os.environ and (Path(sys.prefix) / "share/rclpy").is_dir()
    given = dict(os.environ)
    if wheels:
        for name in ("PYTHONPATH", "LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"):
            given.pop(name, None)
        given.update(AMENT_PREFIX_PATH=sys.prefix, CMAKE_PREFIX_PATH=sys.prefix)
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    options = ["-DCMAKE_BUILD_TYPE=None", "-DCMAKE_C_FLAGS=-O0", "-DCMAKE_CXX_FLAGS=-O0", "-Wno-dev"]
    options += [f"-DPython3_EXECUTABLE={sys.executable}", f"-DCMAKE_INSTALL_PREFIX={made}"]
    for words in (
        ["cmake", "-S", HERE / "px4_msgs", "-B", f"{made}-build", *generator, *options],
        ["cmake", "--build", f"{made}-build", "--target", "install"],
    ):
        done = subprocess.run(list(map(str, words)), env=given, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    shutil.rmtree(f"{made}-build")
    made.rename(prefix)


class Ended(NamedTuple):
    """How a bridge ended, and what the fake autopilot saw."""

    code: int
    output: str
    report: dict


class Flight:
    """A fake autopilot and a bridge in a domain of their own; other processes may join."""

    airframe: str = AIRFRAME
    owner: Path = BRIDGE
    owner_words: Sequence[str] = ()
    grid: Sequence[str] = ()
    """What every node of the flight must be told of the period of states, beyond PERIODS."""
    fake_priority = 45
    """Real-time priority of the fake: an autopilot has a processor of its own, and nodes have 40."""

    def __init__(self, folder: Path, given: dict[str, str], options: dict, *bridge: str) -> None:
        """Start both; ``options`` are the fake's, ``bridge`` are further arguments of the bridge."""
        self.folder, self.processes = folder, []
        folder.mkdir()
        self._domain = reserved_domain(None)
        self.environment = {**given, "ROS_DOMAIN_ID": str(self._domain.__enter__())}
        (folder / "airframe.yaml").write_text(self.airframe or "{}", "utf-8")
        self.fake = self.start("fake", [sys.executable, *self.fake_words(options)])
        log = folder / "fake.log"
        wait_until(lambda: "up" in log.read_text("utf-8").split(), LONGEST, "an autopilot")
        if self.fake_priority:
            with contextlib.suppress(PermissionError):
                os.sched_setscheduler(self.fake.pid, os.SCHED_FIFO, os.sched_param(self.fake_priority))
        files = ["--params-file", VEHICLE, "--params-file", folder / "airframe.yaml"]
        self.bridge = self.start("bridge", [self.owner, "--ros-args", *files, *PERIODS, *self.owner_words, *bridge])

    def fake_words(self, options: dict) -> list:
        """Return the fake autopilot's script and arguments."""
        return [HERE / "fake_px4.py", "0", self.folder / "report.json", json.dumps(options)]

    def node(self, role: str, *arguments: str) -> subprocess.Popen[bytes]:
        """Start a node of the flight with the gains of the x500."""
        return self.replaced(role, [executable(role)], *arguments)

    def replaced(self, role: str, command: list, *arguments: str) -> subprocess.Popen[bytes]:
        """Start ``command`` in the place of a node, with the node's files."""
        files = [word for path in (VEHICLE, GAINS) for word in ("--params-file", path)]
        return self.start(role, [*command, "--ros-args", *files, *PERIODS, *self.grid, *arguments])

    def start(self, name: str, command: list) -> subprocess.Popen[bytes]:
        """Start a process whose output goes to ``name``.log."""
        with (self.folder / f"{name}.log").open("wb") as output:
            process = subprocess.Popen(
                list(map(str, command)), env=self.environment, stdout=output, stderr=subprocess.STDOUT
            )
        self.processes.append(process)
        return process

    def end(self, patience: float = LONGEST) -> Ended:
        """Wait for the bridge, stop all and return how it ended."""
        try:
            code = self.bridge.wait(patience)
        except subprocess.TimeoutExpired:
            code = -1
        return self.stop(code)

    def wait_for(self, word: str) -> None:
        """Wait until the bridge has said ``word``."""
        log = self.folder / "bridge.log"
        wait_until(lambda: word in log.read_text("utf-8"), LONGEST, f"{word} of {log}")

    def __enter__(self) -> "Flight":
        """Return the flight."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop all that still runs."""
        for process in self.processes:
            process.kill()
            process.wait()
        self._domain.__exit__(None, None, None)

    def stop(self, code: int) -> Ended:
        """Stop the fake and return how the bridge ended."""
        self.fake.send_signal(signal.SIGTERM)
        self.fake.wait(LONGEST)
        report = json.loads((self.folder / "report.json").read_text("utf-8"))
        return Ended(code, (self.folder / "bridge.log").read_text("utf-8"), report)


class OverUdp(Flight):
    """A fake vehicle over UDP and its bridge, in a domain of their own; the libraries come from the wheels' lock."""

    script: Path
    address: str
    words: Sequence[str]

    def __init__(self, folder: Path, options: dict, *bridge: str) -> None:
        """Start both; ``options`` are the fake's, ``bridge`` are further arguments of the bridge."""
        paths = os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH", ""), str(vehicle_packages())]))
        super().__init__(folder, {**os.environ, "PYTHONPATH": paths}, options, *bridge)

    def fake_words(self, options: dict) -> list:
        """Return the fake vehicle's script and arguments."""
        port = free_port()
        self.owner_words = ["-p", "max_rotor_thrust:=8.549", "-p", self.address.format(port), *self.words]
        return [self.script, port, self.folder / "report.json", json.dumps(options)]


class MavlinkFlight(OverUdp):
    """A fake PX4 or ArduPilot over MAVLink."""

    airframe = ""
    script = HERE.parent / "mavlink/fake_autopilot.py"
    owner = Path(get_package_prefix("quad_mavlink"), "lib", "quad_mavlink", "mavlink_bridge")
    address = "listen:=127.0.0.1:{}"
    words = ()


class CrazyflieFlight(OverUdp):
    """A fake Crazyflie, whose states come every 10 ms."""

    airframe = ""
    script = HERE.parent / "crazyflie/fake_crazyflie.py"
    owner = Path(get_package_prefix("quad_crazyflie"), "lib", "quad_crazyflie", "crazyflie_bridge")
    address = "uri:=udp://127.0.0.1:{}"
    words = ("-p", "flight.plant_period:=5000000")
    grid = words


class JoinedFlight(Flight):
    """The fake that speaks TCP and DDS, and the owner of plant and bridge."""

    airframe = "/**:\n  ros__parameters:\n    arming: {beats: 25}\n"
    owner = Path(get_package_prefix("quad_mavlink"), "lib", "quad_mavlink", "joined_plant")
    fake_priority = 0  # its time is the plant's, which waits

    def fake_words(self, options: dict) -> list:
        """Return the fake autopilot's script and arguments."""
        port = free_port()
        ground = ["-p", "rigid_body.ground.enabled:=true", "-p", "rigid_body.initial.p.z:=0.1"]
        self.owner_words = [*ground, "-p", "truth_period_steps:=1", "-p", f"listen:=127.0.0.1:{port}"]
        return [HERE / "fake_joined_px4.py", str(port), self.folder / "report.json", json.dumps(options)]

"""Missions over the real wire to a fake vehicle: messages built once, processes, what came of it."""

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from ament_index_python.packages import get_package_prefix
from flying import LONGEST, ROOT, executable, wait_until
from sockets import free_port
from vehicle_packages import vehicle_packages

from quad_bringup.surroundings import reserved_domain

HERE = Path(__file__).parent / "px4"
BRIDGE = Path(get_package_prefix("quad_px4"), "lib", "quad_px4", "px4_bridge")
COMMANDER = Path(get_package_prefix("quad_commander"), "lib", "quad_commander", "commander")
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
    package = HERE / "px4_msgs"
    sources = [package / "CMakeLists.txt", package / "package.xml", *sorted(package.glob("msg/*.msg"))]
    key = hashlib.sha256(b"".join([sys.prefix.encode(), *(path.read_bytes() for path in sources)])).hexdigest()[:16]
    prefix = ROOT / ".cache" / f"px4_msgs-{key}"
    prefix.parent.mkdir(exist_ok=True)
    with prefix.with_suffix(".busy").open("w") as busy:  # tests fly in several threads and processes
        fcntl.flock(busy, fcntl.LOCK_EX)
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
    """How a bridge ended, what it and the commander said, and what the fake autopilot saw."""

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

    def __init__(self, folder: Path, options: dict, *bridge: str) -> None:
        """Start both; ``options`` are the fake's, ``bridge`` are further arguments of the bridge."""
        self.folder, self.processes = folder, {}
        folder.mkdir()
        self._domain = reserved_domain(None)
        self.environment = {**self.given(), "ROS_DOMAIN_ID": str(self._domain.__enter__())}
        (folder / "airframe.yaml").write_text(self.airframe or "{}", "utf-8")
        self.fake = self.start("fake", [sys.executable, *self.fake_words(options)])
        log = folder / "fake.log"
        wait_until(lambda: "up" in log.read_text("utf-8").split(), LONGEST, "an autopilot")
        if self.fake_priority:
            with contextlib.suppress(PermissionError):
                os.sched_setscheduler(self.fake.pid, os.SCHED_FIFO, os.sched_param(self.fake_priority))
        files = ["--params-file", VEHICLE, "--params-file", folder / "airframe.yaml"]
        self.bridge = self.start("bridge", [self.owner, "--ros-args", *files, *PERIODS, *self.owner_words, *bridge])

    @staticmethod
    def given() -> dict[str, str]:
        """Return the environment of all processes."""
        return environment()

    def fake_words(self, options: dict) -> list:
        """Return the fake autopilot's script and arguments."""
        return [HERE / "fake_px4.py", "0", self.folder / "report.json", json.dumps(options)]

    def node(self, role: str, command: list, *arguments: str) -> None:
        """Start ``command`` as a node of the flight with the gains of the x500."""
        files = [word for path in (VEHICLE, GAINS) for word in ("--params-file", path)]
        self.start(role, [*command, "--ros-args", *files, *PERIODS, *self.grid, *arguments])

    def start(self, name: str, command: list) -> subprocess.Popen[bytes]:
        """Start a process whose output goes to ``name``.log."""
        with (self.folder / f"{name}.log").open("wb") as output:
            process = subprocess.Popen(
                list(map(str, command)), env=self.environment, stdout=output, stderr=subprocess.STDOUT
            )
        self.processes[name] = process
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
        for process in self.processes.values():
            process.kill()
            process.wait()
        self._domain.__exit__(None, None, None)

    def stop(self, code: int) -> Ended:
        """Stop the fake and return how the bridge ended."""
        self.fake.send_signal(signal.SIGTERM)
        self.fake.wait(LONGEST)
        report = json.loads((self.folder / "report.json").read_text("utf-8"))
        logs = (self.folder / f"{name}.log" for name in ("bridge", "commander"))
        return Ended(code, "".join(log.read_text("utf-8") for log in logs if log.exists()), report)


def with_packages(given: Mapping[str, str]) -> dict[str, str]:
    """Return an environment in which pymavlink and cflib are found, too."""
    paths = filter(None, [given.get("PYTHONPATH", ""), str(vehicle_packages())])
    return {**given, "PYTHONPATH": os.pathsep.join(paths)}


class OverUdp(Flight):
    """A fake vehicle over UDP and its bridge, in a domain of their own; the libraries come from the wheels' lock."""

    script: Path
    address: str
    words: Sequence[str]

    @staticmethod
    def given() -> dict[str, str]:
        """Return the environment of all processes."""
        return with_packages(os.environ)

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

    airframe = ""
    owner = Path(get_package_prefix("quad_mavlink"), "lib", "quad_mavlink", "joined_plant")
    fake_priority = 0  # its time is the plant's, which waits

    @staticmethod
    def given() -> dict[str, str]:
        """Return the environment of all processes."""
        return with_packages(environment())

    def fake_words(self, options: dict) -> list:
        """Return the fake autopilot's script and arguments."""
        port = free_port()
        ground = ["-p", "rigid_body.ground.enabled:=true", "-p", "rigid_body.initial.p.z:=0.1"]
        self.owner_words = [*ground, "-p", "truth_period_steps:=1", "-p", f"listen:=127.0.0.1:{port}"]
        return [HERE / "fake_joined_px4.py", str(port), self.folder / "report.json", json.dumps(options)]


VEHICLES = {"px4": Flight, "joined": JoinedFlight, "mavlink": MavlinkFlight, "crazyflie": CrazyflieFlight}
PATIENT = ("-p", "input_timeout:=60.0")  # joined the plant waits, so nothing ages
_LATE = ("reference_late", "reference_lost", "setpoint_lost", "state_lost")
WHOLE = "takeoff:2,hold:2,land"


def flown(
    folder: Path,
    vehicle: str,
    options: dict,
    mission: str,
    *bridge: str,
    then: Callable[[Flight], None] | None = None,
    commands: Mapping[str, list] | None = None,
    recorded: bool = False,
    late: float = 0.0,
    commander: Sequence[str] = (),
) -> Ended:
    """Return how a mission ended.

    ``then`` acts in the flight, ``commands`` are started in place of nodes; ``recorded``: into folder ``bag``.
    ``late``: s for which the commander waits while it arms, its default if 0; ``commander``: its further arguments.
    """
    joined = vehicle == "joined"
    own = {
        "trajectory": ["-p", "trajectory:=hover"],
        "position_controller": PATIENT if joined else (),
        "attitude_controller": PATIENT if joined else (),
        "commander": ["-p", f"mission:={mission}", *commander],
    }
    own["commander"] += [word for age in _LATE for word in ("-p", f"modes.{age}:=60.0") if joined]
    own["commander"] += ["-p", f"modes.arming_late:={late}"] if late else []
    if vehicle in ("mavlink", "crazyflie") or "mode:=attitude" in bridge:
        del own["attitude_controller"]
    roles = ["simulator", *own, *(["recorder"] if recorded else [])]
    words = ["-p", f"flight.roles:={','.join(roles)}", "-p", "flight.run_id:=m1"]
    with VEHICLES[vehicle](folder, options, *words, *bridge) as flight:
        for role, more in own.items():
            command = (commands or {}).get(role, [COMMANDER if role == "commander" else executable(role)])
            flight.node(role, command, *words, "-p", "period_steps:=2", *more)
        if recorded:
            flight.node("recorder", [executable("recorder")], *words, "-p", f"directory:={folder / 'bag'}")
        if then is not None:
            then(flight)
        return flight.end()


def in_hold(act: Callable[[Flight], None], seconds: float = 7.0) -> Callable[[Flight], None]:
    """Return what waits until the vehicle is in the air, and then does ``act``."""

    def later(flight: Flight) -> None:
        flight.wait_for("COMPONENT_ARM_DISARM")
        time.sleep(seconds)
        act(flight)

    return later


def killed(name: str) -> Callable[[Flight], None]:
    """Return what kills a process in the air."""
    return in_hold(lambda flight: flight.processes[name].kill())


def cause(ended: Ended) -> str:
    """Return why the flight failed, as the bridge said it."""
    return next(line for line in ended.output.splitlines() if "flight_failed" in line)


def happened(ended: Ended) -> list[str]:
    """Return what the fake noted, in order."""
    return [what for _, what in ended.report["events"]]


def when(ended: Ended, moment: str) -> float:
    """Return when in s of the fake's clock ``moment`` was noted first."""
    return next(at for at, what in ended.report["events"] if what == moment)

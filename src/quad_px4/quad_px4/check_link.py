"""Loses the link to PX4 in each way that it can be lost, and says how long PX4 took each time to fly itself.

On the ground without propellers (the motors turn), or in a simulator. A relay stands between PX4 and flights of
scripts/fly that this command starts; PX4's own messages say when it left our mode. COM_OF_LOSS_T decides in offboard,
the fourth missed arming check (1.25 s) in an external mode of 1.15 to 1.17, which is flown in mode attitude alone.
The limit is the bridge's loss_limit, in such an external mode 1.5 s.

Examples:
  scripts/check_link airframe.yaml --vehicle x500 --preset x500 --domain 0
  scripts/check_link airframe.yaml --vehicle my_vehicle.yaml --agent "MicroXRCEAgent udp4 -p 8888" --only "agent killed"

Exit codes: 0 each loss ended within the limit, 1 one did not or the limit was not refused, 2 nothing was measured.
"""

import argparse
import contextlib
import os
import shlex
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import rclpy
import yaml
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from quad_core.cascade import ATTITUDE, POSITION
from quad_core.command_line import Parser
from quad_core.parameter_files import overrides_for, read_parameter_file
from quad_core.parameters import ParameterError, Value
from quad_px4 import messages
from quad_px4.messages import ARMED, EXTERNAL1, MODE_LOSS, OFFBOARD, mode_name
from quad_px4.parameters import PX4, Px4BridgeParameters

OUT = (
    "VehicleOdometry", "VehicleStatus", "VehicleControlMode", "FailsafeFlags", "VehicleLandDetected", "BatteryStatus",
    "VehicleCommandAck", "RegisterExtComponentReply", "ArmingCheckRequest", "SetpointConfigReply",
)  # fmt: skip
IN = (
    "OffboardControlMode", "VehicleCommand", "VehicleThrustSetpoint", "VehicleTorqueSetpoint", "ActuatorMotors",
    "VehicleAttitudeSetpoint", "RegisterExtComponentRequest", "ArmingCheckReply", "UnregisterExtComponent",
    "SetpointConfig",
)  # fmt: skip
"""The messages of the link, from PX4 and to it; some px4_msgs lack some."""
SIDE = "link_check"  # namespace of the flight's side of the relay
FAULTS = ("bridge killed", "bridge stopped", "controller killed", "agent killed", "link cut", "state frozen")
LIMIT = "limit"  # what --only calls the flight that must be refused
_REFUSED: dict[str, dict[str, Value]] = {"offboard": {"loss_limit": 0.01}, "external": {"mode": "wrench"}}
MODES = ("offboard", "external")
_UNMEASURED = ("not armed", "ended before", "not heard")
_SEEN_LATE = 0.15  # s after its time-out until PX4 says that it misses a stream; measured in offboard: up to 0.11
_STAMPS = struct.Struct("<QQ")
_AFTER_HEADER = 4  # bytes of CDR before timestamp and timestamp_sample
_HEARD_WITHIN, _ARMED_WITHIN, _LEFT_WITHIN, _DOWN_WITHIN, _OFF = 60.0, 120.0, 10.0, 90.0, 3.0  # s
_LONGEST = 400.0  # s for a flight with its end


class Relay:
    """Passes bytes between PX4 and the flight's side; ``status`` is PX4's newest VehicleStatus.

    ``cut``: nothing passes. ``frozen``: the last odometry passes on and on, under fresh stamps.
    """

    def __init__(self, px4: ModuleType, namespace: str) -> None:
        self.cut = False
        self.status: Any = None
        self._frozen, self._newest, self._heard = b"", (0, 0), 0.0
        quality = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._node = rclpy.create_node("link_check", start_parameter_services=False)
        for names, way, source, target in ((OUT, "out", namespace, SIDE), (IN, "in", SIDE, namespace)):
            kinds = [getattr(px4, name) for name in names if hasattr(px4, name)]
            topics = {messages.topic("", way, kind): kind for kind in kinds}
            if way == "in":  # an external mode says by it which of PX4's controllers run
                topics["/fmu/in/config_control_setpoints"] = px4.VehicleControlMode
            for topic, kind in topics.items():
                ends = (f"/{each.strip('/')}{topic}" if each else topic for each in (source, target))
                begin, end = ends
                out = self._node.create_publisher(kind, end, quality)
                take = self._odometry if kind is px4.VehicleOdometry else self._pass
                self._node.create_subscription(kind, begin, partial(take, out), quality, raw=True)
        status = messages.topic(namespace, "out", px4.VehicleStatus)
        self._node.create_subscription(px4.VehicleStatus, status, partial(setattr, self, "status"), quality)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        threading.Thread(target=self._spin, daemon=True).start()

    def _spin(self) -> None:
        with contextlib.suppress(OSError):  # as the nodes of a flight, where that is allowed
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(41))
        self._executor.spin()

    def _pass(self, out: Any, payload: bytes) -> None:
        if not self.cut:
            out.publish(payload)

    def _odometry(self, out: Any, payload: bytes) -> None:
        self._newest, self._heard = _STAMPS.unpack_from(payload, _AFTER_HEADER), time.monotonic()
        if self._frozen:
            payload = b"".join((self._frozen[:_AFTER_HEADER], _STAMPS.pack(*self._newest), self._frozen[20:]))
        self._last = payload
        self._pass(out, payload)

    def freeze(self) -> None:
        """Let the state stand still."""
        self._frozen = self._last

    def heal(self) -> None:
        """Pass on as before."""
        self.cut, self._frozen = False, b""

    def now(self) -> float:
        """Return PX4's time in s."""
        return 1e-6 * self._newest[0] + time.monotonic() - self._heard

    @property
    def is_ours(self) -> bool:
        """Whether PX4 is armed in a mode that a flight of ours has."""
        status = self.status
        return (
            bool(status)
            and status.arming_state == ARMED
            and (status.nav_state == OFFBOARD or EXTERNAL1 <= status.nav_state < EXTERNAL1 + 8)
        )


class Row(NamedTuple):
    """One loss: s until PX4 left our mode (NaN: it did not), where it went, s until it disarmed, what fly said."""

    mode: str
    fault: str
    took: float
    into: str
    down: float
    said: str


class Check:
    """The flights of one vehicle."""

    def __init__(self, options: argparse.Namespace, relay: Relay, watches: bool) -> None:
        """Start the agent, if it is ours to start; ``watches``: PX4 itself misses setpoints in an external mode."""
        self.options, self.relay, self.watches = options, relay, watches
        self.agent = self._agent()

    def _agent(self) -> subprocess.Popen[bytes] | None:
        if not self.options.agent:
            return None
        given = {key: value for key, value in os.environ.items() if not key.startswith(("FASTRTPS", "SKIP_DEFAULT"))}
        return subprocess.Popen(
            shlex.split(self.options.agent), env=given, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    @contextlib.contextmanager
    def _flight(
        self, mode: str, name: str, settings: Mapping[str, Value]
    ) -> Iterator[tuple[subprocess.Popen[str], Path]]:
        options, folder = self.options, self.options.out / f"{mode}-{name.replace(' ', '-')}"
        self.relay.heal()
        if options.before:
            self.relay.status = None
            subprocess.run(shlex.split(options.before), check=True, stdout=subprocess.DEVNULL)
        if not _until(lambda: self.relay.status is not None, _HEARD_WITHIN):
            raise ParameterError(f"no vehicle_status from PX4 in domain {options.domain}: is its agent running?")
        folder.mkdir(parents=True)
        content = {f"/**/{PX4}": {"ros__parameters": {**self._bridge(mode), **settings}}}
        (folder / "airframe.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
        command = ["scripts/fly", "--mission", f"takeoff:{options.height:g},hold:120,land", "--realtime"]
        command += ["--domain", str(options.domain), "--vehicle", options.vehicle, "--preset", options.preset]
        command += ["--vehicle-interface", f"px4={folder / 'airframe.yaml'}", "--out", str(folder / "bag")]
        with (folder / "fly.txt").open("w+", encoding="utf-8") as said:
            fly = subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT, text=True, cwd=options.root)
            try:
                yield fly, folder / "fly.txt"
            finally:
                for _ in range(2):
                    if fly.poll() is None:
                        fly.send_signal(signal.SIGINT)
                        with contextlib.suppress(subprocess.TimeoutExpired):
                            fly.wait(30.0)
                fly.kill()
                fly.wait()

    def _processes(self, fly: subprocess.Popen[str], name: str) -> list[int]:
        """Return the processes ``name`` of a flight, among all that descend from it."""
        parents, found, known = {}, [], {fly.pid}
        for path in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                parents[int(path.name)] = int((path / "stat").read_text().rpartition(")")[2].split()[1])
        while more := {pid for pid, parent in parents.items() if parent in known} - known:
            known |= more
        for pid in known:
            with contextlib.suppress(OSError):
                if f"/{name}\0".encode() in Path(f"/proc/{pid}/cmdline").read_bytes():
                    found.append(pid)
        return found

    def _bridge(self, mode: str) -> dict[str, Value]:
        """Return the parameters of the bridge in a flight of ``mode``."""
        own: dict[str, Value] = {**self.options.bridge, "namespace": SIDE, "external_mode": "", "chosen_by": "bridge"}
        if mode == "external":
            own |= {"external_mode": "Link check"} | ({} if self.watches else {"mode": "attitude"})
        return own

    def _loss(self, fly: subprocess.Popen[str], mode: str, fault: str) -> Callable[[], None]:
        """Return what loses the link at once."""
        if fault == "link cut":
            return partial(setattr, self.relay, "cut", True)
        if fault == "state frozen":
            return self.relay.freeze
        if fault == "agent killed":
            assert self.agent is not None
            return self.agent.kill
        flies = POSITION if self._bridge(mode).get("mode") == "attitude" else ATTITUDE
        name = flies if fault.startswith("controller") else PX4
        pids = self._processes(fly, name)
        if not pids:
            raise ParameterError(f"found no process {name} of the flight")
        return partial(os.kill, pids[0], signal.SIGSTOP if fault == "bridge stopped" else signal.SIGKILL)

    def lose(self, mode: str, fault: str) -> Row:
        """Fly, lose the link by ``fault`` and measure."""
        relay = self.relay
        with self._flight(mode, fault, {}) as (fly, said):
            if not _until(lambda: relay.is_ours or fly.poll() is not None, _ARMED_WITHIN) or not relay.is_ours:
                return Row(mode, fault, float("nan"), "not armed", float("nan"), _words(said))
            time.sleep(self.options.after)
            lose = self._loss(fly, mode, fault) if relay.is_ours else None
            began, ours = relay.now(), relay.status.nav_state
            if lose is None or not relay.is_ours:  # finding a process takes a while
                _until(lambda: fly.poll() is not None, _DOWN_WITHIN)
                return Row(mode, fault, float("nan"), "ended before", float("nan"), _words(said))
            lose()
            if fault == "agent killed":
                time.sleep(_OFF)
                self.agent, relay.status = self._agent(), None
                _until(lambda: relay.status is not None, _LEFT_WITHIN)
            first = relay.status
            _until(lambda: relay.status is not None and relay.status.nav_state != ours, _LEFT_WITHIN)
            status = relay.status
            if status is None or status.nav_state == ours:
                return Row(mode, fault, float("nan"), _stayed(first, status, began), float("nan"), _words(said))
            since = getattr(status, "nav_state_timestamp", status.timestamp)  # a cut px4_msgs may lack the first
            took, into = 1e-6 * since - began, mode_name(status.nav_state)
            is_down = _until(lambda: relay.status.arming_state != ARMED, _DOWN_WITHIN)
            down = relay.now() - began if is_down else float("nan")
            for pid in self._processes(fly, PX4):  # a stopped one would not end
                os.kill(pid, signal.SIGCONT)
            _until(lambda: fly.poll() is not None, 30.0)
        return Row(mode, fault, took, into, down, _words(said))

    def refuse(self, mode: str) -> Row:
        """Ask for what a lost link would make a crash of: the bridge must refuse it."""
        with self._flight(mode, "refused", _REFUSED[mode]) as (fly, said):
            _until(lambda: self.relay.is_ours or fly.poll() is not None, _ARMED_WITHIN)
            why = _words(said)
            is_refused = not self.relay.is_ours and ("arming refused" in why or "external_mode" in why)
        asked = " ".join(f"{name} {value}" for name, value in _REFUSED[mode].items())
        return Row(mode, asked, float("nan"), "refused" if is_refused else "ARMED", float("nan"), why)


def _until(holds: Callable[[], bool], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def _words(path: Path) -> str:
    lines = [line.strip() for line in path.read_text(encoding="utf-8").splitlines()]
    told = [line.removeprefix("fly: ") for line in lines if line.startswith("fly: ")]
    told = [line for line in told if not line.startswith(("to look on", "simulator:"))]
    return (told or ["nothing"])[0]


def _printed(row: Row) -> str:
    took = f"{row.took:.2f} s" if row.took == row.took else "-"
    down = f"{row.down:.1f} s" if row.down == row.down else "-"
    return f"{row.mode:9} {row.fault:18} {took:>8}  {row.into:12} {down:>8}  {row.said}"


def _stayed(first: Any, last: Any, began: float) -> str:
    """Return what a PX4 does that names our mode: its ``first`` and ``last`` status after the loss at s ``began``.

    Disarmed, it names the mode it was last asked for. Later the timer of a vehicle that does not take off disarms, too.
    """
    if last is None or 1e-6 * last.timestamp < began:
        return "not heard"
    return "disarmed" if first is not None and first.arming_state != ARMED else "the same"


def _limit(mode: str, bridge: Mapping[str, Value], watches: bool) -> float:
    """Return within how many s PX4 must fly itself: a bridge with ``loss_limit`` 0 asks for none in particular."""
    given, default = bridge.get("loss_limit"), Px4BridgeParameters().loss_limit
    limit = float(given) if isinstance(given, int | float) else default
    if mode == "external":
        return limit + _SEEN_LATE if watches and limit else MODE_LOSS
    return limit or default


def _code(row: Row, limit: float) -> int:
    """Return the exit code: 0 the loss ended within ``limit`` s or was refused, 1 not, 2 nothing was measured."""
    if row.into in _UNMEASURED or row.took < 0.0:  # negative: PX4 had left before
        return 2
    return int(row.into not in ("disarmed", "refused") and not row.took <= limit)


def _parser() -> Parser:
    about, _, examples = (__doc__ or "").partition("\n\n")
    parser = Parser(prog="check_link", description=about, epilog=examples)
    parser.add_argument("airframe", type=Path, metavar="FILE", help="the bridge's own file, as for --vehicle-interface")
    parser.add_argument("--vehicle", default="px4_sih", metavar="NAME|FILE", help="as for fly (default: px4_sih)")
    parser.add_argument("--preset", default="x500", metavar="NAME|FILE", help="as for fly (default: x500)")
    parser.add_argument("--domain", type=int, default=0, metavar="N", help="ROS domain of the agent (default: 0)")
    parser.add_argument("--agent", default="", metavar="COMMAND", help="starts the agent; without it none is killed")
    parser.add_argument("--before", default="", metavar="COMMAND", help="run before each flight: restarts a simulator")
    parser.add_argument("--mode", choices=MODES, action="append", help="may be repeated (default: both)")
    parser.add_argument("--only", choices=(*FAULTS, LIMIT), action="append", help="may be repeated (default: all)")
    parser.add_argument("--after", type=float, default=3.0, metavar="S", help="s from armed to the loss (default: 3)")
    parser.add_argument("--height", type=float, default=1.5, metavar="M", help="of the take-off (default: 1.5)")
    parser.add_argument("--times", type=int, default=1, metavar="N", help="each loss N times (default: 1)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="bags and words (default: flights/link-DATE)")
    return parser


def _whole(name: str) -> str:
    """Return the whole path of a file that is there: fly runs in another folder."""
    return str(Path(name).resolve()) if Path(name).is_file() else name


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit code."""
    options = _parser().parse_args(arguments)
    options.root = Path(os.environ["QUAD_ROOT"])
    options.vehicle, options.preset = _whole(options.vehicle), _whole(options.preset)
    options.out = (options.out or Path(time.strftime("flights/link-%Y%m%d-%H%M%S"))).resolve()
    try:
        options.bridge = overrides_for([read_parameter_file(options.airframe)], PX4)
        px4 = messages.load()
    except ParameterError as error:
        print(f"check_link: {error}", file=sys.stderr)
        return 2
    print(f"{'mode':9} {'lost by':18} {'PX4 after':>8}  {'flies':12} {'disarmed':>8}  fly said", flush=True)
    wanted = _wanted(options, hasattr(px4, "SetpointConfig"))
    if len(wanted) == 1:
        return _fly(options, px4, *wanted[0][:2])
    codes = [_fly_apart(options, *each) for each in wanted]
    return 2 if set(codes) <= {2} else int(any(codes))


def _wanted(options: argparse.Namespace, watches: bool) -> list[tuple[str, str, int]]:
    """Return mode, loss and number of each flight; ``watches``: PX4 itself misses setpoints in an external mode."""
    found = []
    for mode in options.mode or MODES:
        for fault in options.only or (*FAULTS, LIMIT):
            times = options.times if options.agent or fault != "agent killed" else 0
            if fault == LIMIT:
                by_attitude = options.bridge.get("mode") == "attitude"  # PX4 may then lose the stream for any time
                times = int(not by_attitude if mode == "offboard" else not watches)
            found += [(mode, fault, number + 1) for number in range(times)]
    return found


def _fly_apart(options: argparse.Namespace, mode: str, fault: str, number: int) -> int:
    """Fly one loss in a process of its own, once more if it measured nothing, and print its row; returns its exit code.

    Fast DDS 2.14 locks itself up in a process that sees many nodes being killed, now and then at the first one.
    """
    words = [sys.executable, "-m", "quad_px4.check_link", str(options.airframe), "--mode", mode, "--only", fault]
    for name in ("vehicle", "preset", "domain", "agent", "before", "after", "height"):
        words += [f"--{name}", str(getattr(options, name))]
    code, said = 2, ""
    for out in (options.out / f"{number}", options.out / f"{number}-again"):
        flight = subprocess.Popen(
            [*words, "--out", str(out)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        try:
            said = flight.communicate(timeout=_LONGEST)[0]
        except subprocess.TimeoutExpired:
            flight.kill()
            said = f"{flight.communicate()[0]}{mode:9} {fault:18} hung"
        code = 2 if flight.returncode < 0 else flight.returncode
        if code != 2:
            break
    print("\n".join(said.splitlines()[-1:]), flush=True)
    return code


def _fly(options: argparse.Namespace, px4: ModuleType, mode: str, fault: str) -> int:
    """Fly one loss in this process and print its row; returns the exit code."""
    os.environ["ROS_DOMAIN_ID"] = str(options.domain)
    rclpy.init(args=[], domain_id=options.domain, signal_handler_options=SignalHandlerOptions.NO)
    check = None
    try:
        check = Check(options, Relay(px4, str(options.bridge.get("namespace", ""))), hasattr(px4, "SetpointConfig"))
        row = check.refuse(mode) if fault == LIMIT else check.lose(mode, fault)
    except (ParameterError, OSError, subprocess.CalledProcessError) as error:
        print(f"check_link: {error}", file=sys.stderr)
        return 2
    finally:
        if check is not None and check.agent is not None:
            check.agent.kill()
    print(_printed(row), flush=True)
    return _code(row, _limit(mode, options.bridge, check.watches))


if __name__ == "__main__":
    found = main()
    sys.stdout.flush()
    os._exit(found)  # Fast DDS 2.14 can lock itself up in its end where nodes were killed

"""`ros2 run quad_crazyflie crazyflie_bridge`: takes the simulator's place with a Crazyflie, over cflib.

Subscribes: attitude_setpoint, which becomes manual setpoints. Reads every 2 ms what cflib's thread has put down: the
log block becomes ``state``. It has no torque setpoint: attitude laws stay in shadow. ``actuation`` is a prediction: a
Crazyflie reports none. What it does for the flight: ``quad_autopilot.autopilot_flight``.

cflib is under the GPL-3: this package imports it and is of use only with it, so who ships this package together with
cflib ships the whole under the GPL-3. Nothing else of the stack imports either.
"""

import importlib
import logging
import sys
from collections import deque
from typing import Any

from quad_autopilot import thrust
from quad_autopilot.arming import Setpoint
from quad_autopilot.autopilot import ARM_DISARM, DO_SET_MODE, NAV_LAND, Ack, Autopilot, Control, Profile, Request
from quad_autopilot.autopilot_flight import BEAT, LOOK, AutopilotFlight
from quad_autopilot.evidence import Phase
from quad_autopilot.parameters import Flier
from quad_core.cascade import POSITION, STAGE
from quad_core.parameters import ParameterError
from quad_core.types import AttitudeThrust, VehicleState
from quad_crazyflie import setpoints
from quad_crazyflie.parameters import CRAZYFLIE, INTERFACE
from quad_msgs.msg import FlightState
from quad_node.main import run

PERIOD = 10  # milliseconds between two log blocks: the shortest that a Crazyflie gives
CAN_ARM, ARMED, AUTO_ARMED, CAN_FLY, FLYING, TUMBLED, LOCKED, CRASHED, HIGH_LEVEL = (1 << bit for bit in range(9))
FAULTS = {TUMBLED: "tumbled", LOCKED: "locked: restart it", CRASHED: "crashed"}
PROFILE = Profile(
    "Crazyflie", "SETPOINTS", "log block", "log block", "is it on, and the URI right?", Request(DO_SET_MODE)
)
_TOUCHED = 0.05  # m
_AROUND = 1 << 24  # ms after which the stamps of log blocks begin again: 4.7 hours
MANUAL_SINCE = 10
"""CRTP protocol version of firmware 2025.09, the first that takes manual setpoints: an older one drops them."""


def load() -> tuple[Any, Any, Any]:
    """Return cflib.crtp, Crazyflie and LogConfig; raises ParameterError if cflib is not there."""
    try:
        crtp, crazyflie, log = map(importlib.import_module, ("cflib.crtp", "cflib.crazyflie", "cflib.crazyflie.log"))
        return crtp, crazyflie.Crazyflie, log.LogConfig
    except ImportError as error:
        raise ParameterError(
            f"cflib: not found ({error}); install it in addition: "
            "pip install --no-deps --require-hashes -r requirements/vehicles/lock.txt (GPL-3)"
        ) from error


class CrazyflieBridge:
    """A Crazyflie: unlocked, flown by angles, yaw rate and thrust, landed by itself.

    ``blocks`` fills in cflib's thread; all else is the node's thread.
    """

    def __init__(self) -> None:
        """Look for cflib and begin to connect; raises ParameterError for what cannot fly."""
        self.flight = AutopilotFlight(
            CRAZYFLIE, PROFILE, ask=self.request, missing=self._missing, refusal=self._refusal, shut_down=self.shut_down
        )
        self.node, self.settings = self.flight.node, self.flight.settings
        thrust.require(self.settings.max_rotor_thrust, INTERFACE.page)
        if self.settings.arming.takeoff == Flier.AUTOPILOT:
            raise ParameterError("arming.takeoff: found autopilot, expected ours: a Crazyflie's take-off is not used")
        self._largest = setpoints.largest_thrust(self.settings) / 4.0
        self.flight.predicted = thrust.predicted(0.0, self._largest)
        crtp, kind, self._log_config = load()
        logging.getLogger("cflib").setLevel(logging.CRITICAL)  # what matters comes by callback
        if not crtp.CLASSES:
            crtp.init_drivers()
        self.blocks: deque[tuple[int, dict[str, float]]] = deque(maxlen=100)
        self.problem = ""
        self.battery = 0.0
        self._info, self._stamp = 0, _AROUND
        self._is_claimed = self._is_armed = self._is_landing = False
        self._airborne_until = 0.0
        self._cf = kind()
        self._cf.connected.add_callback(self._on_connected)
        self._cf.connection_failed.add_callback(self._on_problem)
        self._cf.connection_lost.add_callback(self._on_problem)
        self._cf.open_link(self.settings.uri)
        self.node.measures.append(self._measured)
        self.node.links.subscribe(STAGE[POSITION].output, self._take_setpoint, raw=True)
        self.node.every(LOOK, self.read)
        self.node.every(BEAT, self.step)

    def step(self) -> None:
        """Keep the Crazyflie in our mode and ask it for what is due, every 20 ms."""
        if not self.flight.begin_step():
            return
        self.read()
        due = self.flight.step()
        if due.setpoint == Setpoint.IDLE and self.flight.state is not None:
            self._cf.commander.send_setpoint(0.0, 0.0, 0.0, 0)  # rotors stand, and the thrust is unlocked
        # when given up nothing: the landing that is asked for comes first

    def _take_setpoint(self, payload: bytes) -> None:
        if (setpoint := self.flight.accepted(payload)) is not None and self.flight.state is not None:
            self.send_attitude(setpoint, self.flight.state)

    def _on_problem(self, _uri: str, text: str) -> None:
        self.problem = " ".join(text.partition("Traceback")[0].split())[:200]

    def _on_connected(self, _uri: str) -> None:
        version = self._cf.platform.get_protocol_version()
        if version < MANUAL_SINCE:
            self.problem = (
                f"its firmware speaks CRTP version {version}, expected {MANUAL_SINCE} (firmware 2025.09) or later: "
                "older firmware drops manual setpoints without a word"
            )
            return
        block = self._log_config("state", PERIOD)
        for name, kind in setpoints.BLOCK.items():
            block.add_variable(name, kind)
        try:
            self._cf.log.add_config(block)
        except (KeyError, AttributeError) as error:
            self.problem = f"its firmware logs too little: {error}"
            return
        block.data_received_cb.add_callback(self._on_block)
        block.start()

    def _on_block(self, timestamp: int, data: dict[str, float], _block: Any) -> None:
        self.blocks.append((timestamp, data))

    def read(self) -> None:
        """Take what cflib's thread has put down; a link or a battery that fails ends the flight."""
        while self.blocks:
            self.flight.spoke_at = self.flight.clock()
            stamp, block = self.blocks.popleft()
            self._stamp += (stamp - self._stamp + _AROUND // 2) % _AROUND - _AROUND // 2
            self.note(block)
            self.flight.take(setpoints.sample(self._stamp, block))
        problem = self._battery_refusal() if self.flight.leader.phase == FlightState.FLYING else ""
        if self.problem:
            problem = f"{self.settings.uri}: {self.problem}"
        self.flight.stop = self.flight.stop or problem

    def note(self, block: dict[str, float]) -> None:
        """Take battery and flags of a block; disarm after a landing of its own."""
        self.battery, self._info = 1e-3 * block["pm.vbatMV"], int(block["supervisor.info"])
        height, now = 1e-3 * block["stateEstimateZ.z"] - self.flight.lift.ground_z, self.flight.clock()
        if (self._info & FLYING and height > _TOUCHED) or not self._is_landing:
            self._airborne_until = now + 0.5
        elif now > self._airborne_until and self._is_armed:
            self._cf.high_level_commander.stop()
            self._cf.supervisor.send_arming_request(False)
            self._is_armed = False
        self._renew()

    def _renew(self) -> None:
        """Bring ``flight.said`` up to what the Crazyflie said last and was asked for."""
        faults = tuple(text for bit, text in FAULTS.items() if self._info & bit)
        others = bool(self._info & HIGH_LEVEL) and not self._is_landing
        control = Control.LANDING if self._is_landing else Control.OURS if self._is_claimed else Control.OTHER
        self.flight.said = Autopilot(
            "HIGH_LEVEL" if others or self._is_landing else "SETPOINTS",
            Control.OTHER if others else control,
            self._is_armed and bool(self._info & ARMED) and not faults,
            failsafe=bool(faults),
            checks_pass=bool(self._info & (CAN_ARM | ARMED)),
            reasons=faults,
        )

    def _missing(self) -> list[str]:
        """Return what the Crazyflie still has to do: to connect may take longer than a step of the arming sequence."""
        is_known = self.flight.said is not None or self.problem
        return [] if is_known else [f"{self.settings.uri}: the tables of its log and parameters"]

    def _refusal(self) -> str:
        """Return what speaks against a flight: an empty battery, or thrust that does not suffice."""
        weak = thrust.weakness(self.node.vehicle, self._largest, "max_rotor_thrust at 100 %")
        return self._battery_refusal() or weak

    def _battery_refusal(self) -> str:
        if self.battery < self.settings.low_battery:
            return f"battery {self.battery:.2f} V, expected at least {self.settings.low_battery:g} V"
        return ""

    def request(self, request: Request) -> None:
        """Carry out what the sequence asks for in the Crazyflie's own way."""
        if request.command == DO_SET_MODE:  # none is needed: setpoints take precedence
            self._is_claimed = True
        elif request.command == ARM_DISARM:
            self._is_armed = request.param1 == 1.0
            self._cf.supervisor.send_arming_request(self._is_armed)
        elif request.command == NAV_LAND:
            state, ground = self.flight.state, self.flight.lift.ground_z
            height = state.p_w.z - state.ground_z if state else 0.0
            self._is_landing = True
            # without it the high level commander is not listened to
            self._cf.commander.send_notify_setpoint_stop()
            self._cf.high_level_commander.land(ground, max(height / self.settings.landing_speed, 1.0), yaw=None)
        self.flight.ack = Ack(request.command, 0)
        self._renew()

    def send_attitude(self, setpoint: AttitudeThrust, state: VehicleState) -> None:
        """Send angles, yaw rate and thrust."""
        self.flight.predicted = thrust.predicted(setpoint.thrust, self._largest)
        self._cf.commander.send_setpoint_manual(*setpoints.manual(self.settings, setpoint, state), rate=False)

    def _measured(self) -> dict[str, float]:
        """Return the battery in V."""
        return {} if self.flight.phase == Phase.STREAM else {"battery_v": self.battery}

    def shut_down(self) -> None:
        """Close the link without a word: cflib itself would send a zero setpoint, which drops a flying vehicle."""
        if self._cf.link is not None:
            self._cf.link.close()
            self._cf.link = None


def main() -> None:
    """Run the bridge to a Crazyflie."""
    text = "Bridge to a Crazyflie: takes attitude_setpoint, publishes state."
    sys.exit(run(CRAZYFLIE, CrazyflieBridge, text))

"""One Crazyflie over cflib, without ROS: what its supervisor says, how it is armed, flown and landed.

cflib is under the GPL-3: this package imports it and is of use only with it, so who ships this package together with
cflib ships the whole under the GPL-3. Nothing else of the stack imports either.
"""

import importlib
import logging
from collections import deque
from collections.abc import Callable
from typing import Any

from quad_autopilot.autopilot import (
    ARM_DISARM,
    DO_SET_MODE,
    NAV_LAND,
    Ack,
    Autopilot,
    Control,
    Profile,
    Request,
)
from quad_core.parameters import ParameterError
from quad_crazyflie.parameters import CrazyflieBridgeParameters
from quad_crazyflie.setpoints import BLOCK, Manual

PERIOD = 10
"""Milliseconds between two log blocks: the shortest that a Crazyflie gives."""
CAN_ARM, ARMED, AUTO_ARMED, CAN_FLY, FLYING, TUMBLED, LOCKED, CRASHED, HIGH_LEVEL = (1 << bit for bit in range(9))
FAULTS = {TUMBLED: "tumbled", LOCKED: "locked: restart it", CRASHED: "crashed"}
PROFILE = Profile(
    "Crazyflie", "SETPOINTS", "log block", "log block", "is it on, and the URI right?", Request(DO_SET_MODE)
)
_TOUCHED = 0.05  # m
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


class CrazyflieVehicle:
    """``blocks`` fills in cflib's thread, ``wake`` is called there; all else is the caller's thread."""

    def __init__(self, settings: CrazyflieBridgeParameters, wake: Callable[[], None]) -> None:
        """Begin to connect; raises ParameterError without cflib."""
        crtp, kind, self._log_config = load()
        logging.getLogger("cflib").setLevel(logging.CRITICAL)  # what matters comes by callback
        if not crtp.CLASSES:
            crtp.init_drivers()
        self.settings, self._wake = settings, wake
        self.blocks: deque[tuple[int, dict[str, float]]] = deque(maxlen=100)
        self.ack: Ack | None = None
        self.problem = ""
        self.battery = 0.0
        self._info: int | None = None
        self._is_claimed = self._is_armed = self._is_landing = False
        self._airborne_until = self._ground_z = 0.0
        self._cf = kind()
        self._cf.connected.add_callback(self._on_connected)
        self._cf.connection_failed.add_callback(self._on_problem)
        self._cf.connection_lost.add_callback(self._on_problem)
        self._cf.open_link(settings.uri)

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
        for name, kind in BLOCK.items():
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
        self._wake()

    def note(self, block: dict[str, float], now: float) -> None:
        """Take battery and flags of a block; ``now`` in s."""
        self.battery, self._info = 1e-3 * block["pm.vbatMV"], int(block["supervisor.info"])
        flying = self._info & FLYING and 1e-3 * block["stateEstimateZ.z"] - self._ground_z > _TOUCHED
        if flying or not self._is_landing:
            self._airborne_until = now + 0.5
        elif self._is_landing and now > self._airborne_until and self._is_armed:
            self._cf.high_level_commander.stop()
            self._cf.supervisor.send_arming_request(False)
            self._is_armed = False

    @property
    def autopilot(self) -> Autopilot | None:
        """What the Crazyflie says of itself; None before its first block."""
        info = self._info
        if info is None:
            return None
        faults = [text for bit, text in FAULTS.items() if info & bit]
        others = bool(info & HIGH_LEVEL) and not self._is_landing
        control = Control.LANDING if self._is_landing else Control.OURS if self._is_claimed else Control.OTHER
        armed = self._is_armed and bool(info & ARMED) and not faults
        return Autopilot(
            "HIGH_LEVEL" if others or self._is_landing else "SETPOINTS",
            Control.OTHER if others else control,
            armed,
            bool(faults),
            bool(info & (CAN_ARM | ARMED)),
            tuple(faults),
        )

    def refusal(self) -> str:
        """Return what speaks against a flight; empty if nothing."""
        if self.battery < self.settings.low_battery:
            return f"battery {self.battery:.2f} V, expected at least {self.settings.low_battery:g} V"
        return ""

    def request(self, request: Request, height: float, ground_z: float = 0.0) -> None:
        """Carry out what the sequence asks for; ``height`` in m is what a landing has to go, down to ``ground_z``."""
        self._ground_z = ground_z
        if request.command == DO_SET_MODE:  # none is needed: setpoints take precedence
            self._is_claimed = True
        elif request.command == ARM_DISARM:
            self._is_armed = request.param1 == 1.0
            self._cf.supervisor.send_arming_request(self._is_armed)
        elif request.command == NAV_LAND:
            self._is_landing = True
            # without it the high level commander is not listened to
            self._cf.commander.send_notify_setpoint_stop()
            self._cf.high_level_commander.land(ground_z, max(height / self.settings.landing_speed, 1.0), yaw=None)
        self.ack = Ack(request.command, 0)

    def idle(self) -> None:
        """Send the zero setpoint: rotors stand, and the thrust is unlocked."""
        self._cf.commander.send_setpoint(0.0, 0.0, 0.0, 0)

    def fly(self, setpoint: Manual) -> None:
        """Send a manual setpoint by angles."""
        self._cf.commander.send_setpoint_manual(*setpoint, rate=False)

    def close(self) -> None:
        """Close the link without a word: cflib itself would send a zero setpoint, which drops a flying vehicle."""
        if self._cf.link is not None:
            self._cf.link.close()
            self._cf.link = None

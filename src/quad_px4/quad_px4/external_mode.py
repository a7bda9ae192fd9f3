"""Our flight as a mode in PX4's own list, which a ground station shows and a pilot selects (PX4 1.15 and newer).

::

    register_ext_component_request ->             name, with an arming check
                                   <- register_ext_component_reply         number of the mode, of the check
    config_control_setpoints       ->             which of PX4's controllers run in the mode (to 1.17)
    setpoint_config                ->             from 1.18 on, once it is registered and once it is selected: which
                                                  setpoints come, and after how many ms without one PX4 flies itself
                                   <- setpoint_config_reply                whether it can be, then that it holds
                                   <- arming_check_request                 every 0.3 s
    arming_check_reply             ->             within 50 ms; at the fourth miss PX4 takes the mode as dead (1.25 s)
    unregister_ext_component       ->             at the end

A PX4 or px4_msgs that lacks this, or refuses, is flown in offboard, and ``failure`` says why.
"""

import secrets
import time
from collections.abc import Callable
from types import ModuleType
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from quad_autopilot.autopilot import SET_NAV_STATE, Profile, Request
from quad_px4 import messages
from quad_px4.parameters import ChosenBy, Mode

NAME_LENGTH = 24
NEEDED = {
    "RegisterExtComponentRequest": ("request_id", "name", "register_mode", "register_arming_check"),
    "RegisterExtComponentReply": ("request_id", "success", "mode_id", "arming_check_id"),
    "ArmingCheckRequest": ("request_id",),
    "ArmingCheckReply": ("request_id", "registration_id", "can_arm_and_run", "mode_req_local_position"),
    "UnregisterExtComponent": ("name", "mode_id", "arming_check_id", "mode_executor_id"),
    "VehicleControlMode": ("source_id", "flag_control_rates_enabled", "flag_control_allocation_enabled"),
}
CONTROLLERS = {Mode.WRENCH: ("allocation",), Mode.MOTORS: (), Mode.ATTITUDE: ("attitude", "rates", "allocation")}
"""{mode: PX4's own controllers that run in it}."""
TYPES = {Mode.MOTORS: 1, Mode.ATTITUDE: 6, Mode.WRENCH: 15}  # {mode: SetpointConfig.type}
RESULTS = ("", "another failure", "unsupported for this vehicle", "unknown to this PX4")  # of a SetpointConfigReply
REQUIRED = ("angular_velocity", "attitude", "local_alt", "local_position")  # what PX4's estimate must have in our mode
_QUALITY = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
_ASK_EVERY, _ASKS = 1.0, 5
_TRIES = 50  # of 20 ms
_CONFIG = "config_control_setpoints"


class ExternalMode:
    """The registration of one mode.

    ``nav_state`` is its number in PX4, -1 until it is registered; ``failure``: why it cannot be, empty if it can.
    ``watches``: PX4 itself misses our setpoints after ``timeout`` s (1.18). Else it does so after MODE_LOSS.
    """

    def __init__(
        self,
        node: Node,
        px4: ModuleType,
        namespace: str,
        name: str,
        mode: Mode,
        refusal: Callable[[], str],
        timeout: float = 0.0,
    ) -> None:
        """Ask PX4 for a mode ``name`` that sends the setpoints of ``mode``; ``refusal``: why it cannot be armed now."""
        self.nav_state, self.failure, self._check = -1, "", -1
        self.watches, self._timeout = hasattr(px4, "SetpointConfig"), timeout
        self._registered, self._is_applied, self._tries = -1, False, 0
        self._node, self._px4, self._space, self._name, self._mode = node, px4, namespace, name, mode
        self._refusal, self._number = refusal, secrets.randbits(63)
        self._asks, self._ask_at = 0, time.monotonic()
        if lacking := messages.missing(px4, NEEDED):
            self.failure = f"px4_msgs has no {lacking}; external modes need that of 1.15 or newer"
            return
        self._request_out = self._out("RegisterExtComponentRequest")
        self._answer_out, self._leave_out = self._out("ArmingCheckReply"), self._out("UnregisterExtComponent")
        heard = [("RegisterExtComponentReply", self._on_reply), ("ArmingCheckRequest", self._on_check)]
        if self.watches:
            self._config_out = self._out("SetpointConfig")
            heard.append(("SetpointConfigReply", self._on_configured))
        else:
            topic = messages.topic(namespace, "in", px4.VehicleControlMode).replace("vehicle_control_mode", _CONFIG)
            self._config_out = node.create_publisher(px4.VehicleControlMode, topic, _QUALITY)
        for kind, callback in heard:
            message = getattr(px4, kind)
            node.create_subscription(message, messages.topic(namespace, "out", message), callback, _QUALITY)

    def _out(self, kind: str) -> Any:
        message = getattr(self._px4, kind)
        return self._node.create_publisher(message, messages.topic(self._space, "in", message), _QUALITY)

    @property
    def is_open(self) -> bool:
        """Whether PX4 has not answered yet."""
        return self.nav_state < 0 and not self.failure

    def ask(self, stamp: int) -> None:
        """Ask for the registration, once a second until it is answered; ``stamp`` in us of PX4."""
        now = time.monotonic()
        if not self.is_open or now < self._ask_at:
            return
        if self._asks == _ASKS:
            reply = "register_ext_component_reply" if self._registered < 0 else "setpoint_config_reply"
            self.failure = f"no {reply} in {_ASKS} s: PX4 is older than 1.15, or has no such topic"
            return
        self._asks, self._ask_at = self._asks + 1, now + _ASK_EVERY
        if self._registered >= 0:
            self._configure(stamp, apply=False)
            return
        message = self._px4.RegisterExtComponentRequest(timestamp=stamp, request_id=self._number)
        message.name = _letters(self._name)
        message.px4_ros2_api_version = message.LATEST_PX4_ROS2_API_VERSION
        message.register_arming_check = message.register_mode = True
        self._request_out.publish(message)

    def _on_reply(self, message: Any) -> None:
        if message.request_id != self._number or not self.is_open or self._registered >= 0:
            return
        expected = self._px4.RegisterExtComponentRequest.LATEST_PX4_ROS2_API_VERSION
        if message.px4_ros2_api_version != expected:
            self.failure = f"PX4 registers by version {message.px4_ros2_api_version}, px4_msgs has {expected}"
        elif not message.success:
            self.failure = "PX4 refused to register it: armed, or no free place among its external modes"
        else:
            self._registered, self._check, self._asks = int(message.mode_id), int(message.arming_check_id), 0
            if self.watches:
                self._configure(message.timestamp, apply=False)
                return
            self.nav_state = self._registered
            config = self._px4.VehicleControlMode(timestamp=message.timestamp, source_id=self.nav_state)
            for controller in CONTROLLERS[self._mode]:
                setattr(config, f"flag_control_{controller}_enabled", True)
            self._config_out.publish(config)

    def selected(self, is_selected: bool, stamp: int) -> None:
        """Have PX4 apply our setpoints once our mode is selected; called every 20 ms."""
        if not self.watches or self.nav_state < 0:
            return
        self._is_applied, self._tries = self._is_applied and is_selected, self._tries + 1 if is_selected else 0
        if is_selected and not self._is_applied:
            self._configure(stamp, apply=True)
            if self._tries > _TRIES:
                self.failure = "PX4 did not apply its setpoints"

    def _configure(self, stamp: int, *, apply: bool) -> None:
        message = self._px4.SetpointConfig(timestamp=stamp, type=TYPES[self._mode], should_apply=apply)
        message.source_id = self.nav_state if apply else self._registered
        message.timeout_ms = round(1e3 * self._timeout)
        self._config_out.publish(message)

    def _on_configured(self, message: Any) -> None:
        if message.source_id != self._registered or message.type != TYPES[self._mode]:
            return
        if message.result:
            why = RESULTS[message.result] if message.result < len(RESULTS) else f"result {message.result}"
            self.failure = f"PX4 refused its setpoints: {why}"
        self._is_applied, self.nav_state = self.nav_state >= 0, self._registered

    def _on_check(self, message: Any) -> None:
        if self.nav_state < 0:
            return
        answer = self._px4.ArmingCheckReply(timestamp=message.timestamp, request_id=message.request_id)
        answer.registration_id, answer.can_arm_and_run = self._check, not self._refusal()
        for name in REQUIRED:
            setattr(answer, f"mode_req_{name}", True)
        self._answer_out.publish(answer)

    def profile(self, before: Profile, chosen_by: ChosenBy) -> Profile:
        """Return how a PX4 with this mode is asked; where a pilot chooses it, nothing is asked."""
        request = Request(SET_NAV_STATE, float(self.nav_state)) if chosen_by == ChosenBy.BRIDGE else None
        return before._replace(offboard=self._name, mode=request)

    def close(self) -> None:
        """Have PX4 take the mode out of its list."""
        if self._registered >= 0:
            message = self._px4.UnregisterExtComponent(name=_letters(self._name), mode_executor_id=-1)
            message.mode_id, message.arming_check_id = self._registered, self._check
            self._leave_out.publish(message)


def _letters(name: str) -> list[int]:
    """Return a name as PX4's char[25]."""
    given = name.encode("ascii", "replace")[:NAME_LENGTH]
    return [*given, *[0] * (NAME_LENGTH + 1 - len(given))]

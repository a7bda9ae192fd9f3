"""An autopilot that can refuse, over the real DDS wire: python fake_px4.py PORT REPORT '{"option": value}'.

It is written from interface facts and imports nothing of the bridge. It cannot show an estimator, true scale or true
timing. It writes REPORT (JSON) when it is stopped. Options are the fields of ``OPTIONS``; times are s of its clock.
"""

import os
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import rclpy
from body import Body, Fake
from px4_msgs import msg
from rclpy.clock import Clock, ClockType
from rclpy.experimental import EventsExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

OPTIONS = {
    "bad_preflight": False,
    "refused": {},  # {command: result}
    "drop": 0.0,  # share of the odometry
    "reorder": 0.0,
    "nan_every": 0,  # samples
    "reset_after": 0.0,  # s in offboard and armed; 0: never
    "reset_by": 0.1,  # m
    "pilot_after": 0.0,
    "silent_after": 0.0,  # no odometry from then on
    "frozen_after": 0.0,  # the same odometry from then on, under new stamps
    "battery": 0.9,
    "battery_after": 0.0,  # s in offboard and armed until it is at 5 %; 0: never
    "external": "",  # "": no such topics, "refused", or "accepted"
    "selected_after": 0.0,  # s after a mode of ours was registered until a pilot selects it; 0: never
}
SET_MODE, ARM, LAND, TAKEOFF, SET_NAV_STATE = 176, 400, 21, 22, 100001
OFFBOARD, AUTO_LOITER, AUTO_LAND, POSCTL, AUTO_TAKEOFF, EXTERNAL = 14, 4, 18, 2, 17, 23
FLYING = (OFFBOARD, AUTO_TAKEOFF, AUTO_LOITER, EXTERNAL)
CHECK_EVERY, MISSES = 0.3, 3
TAKEOFF_HEIGHT = 2.5
ARMED, DISARMED = 2, 1
BEATS = 20
ACK_DELAY, SPOOL_UP, LOSS = 0.02, 1.0, 0.1  # s; COM_SPOOLUP_TIME, COM_OF_LOSS_T
LEVELS = ("position", "velocity", "acceleration", "attitude", "body_rate", "thrust_and_torque", "direct_actuator")


class FakePx4(Fake):
    """State machine, controllers and messages around a ``Body``."""

    def __init__(self, _port, options):
        self.options = {**OPTIONS, **options}
        self.body, self.random = Body(), np.random.default_rng(3)
        self.now = 3.0  # its own clock, of no other's epoch
        self.nav_state, self.arming_state, self.failsafe = AUTO_LOITER, DISARMED, False
        self.beats, self.last_beat, self.level = 0, -1.0, ""
        self.torque, self.thrust, self.motors = np.zeros(3), np.zeros(3), np.zeros(4)
        self.attitude, self.attitude_thrust = np.eye(3), 0.0
        self.armed_at, self.landed_for, self.flown_for = 0.0, 0.0, 0.0
        self.acks, self.held_back, self.resets, self.shift = [], None, 0, np.zeros(3)
        self.samples, self.next_sample = 0, 0.0
        self.flags = msg.FailsafeFlags()
        self.registered, self.config, self.check_at, self.checks, self.can_run = 0.0, None, 0.0, [0, 0], False
        self.said = {}  # {topic: (when, what) of its last message}
        self.report = {"events": [], "wrenches": [], "poses": [], "heartbeats": [], "setpoints": [], "idle_broken": 0}
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node("fake_px4", enable_rosout=False, start_parameter_services=False)
        self.listen()

    def listen(self):
        out = QoSProfile(
            depth=1, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.TRANSIENT_LOCAL
        )
        into = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE)
        self.odometry_out = self.node.create_publisher(msg.VehicleOdometry, "/fmu/out/vehicle_odometry", out)
        self.status_out = self.node.create_publisher(msg.VehicleStatus, "/fmu/out/vehicle_status_v1", out)
        self.control_out = self.node.create_publisher(msg.VehicleControlMode, "/fmu/out/vehicle_control_mode", out)
        self.ack_out = self.node.create_publisher(msg.VehicleCommandAck, "/fmu/out/vehicle_command_ack", out)
        self.landed_out = self.node.create_publisher(msg.VehicleLandDetected, "/fmu/out/vehicle_land_detected", out)
        self.battery_out = self.node.create_publisher(msg.BatteryStatus, "/fmu/out/battery_status_v1", out)
        self.reply_out = self.node.create_publisher(
            msg.RegisterExtComponentReply, "/fmu/out/register_ext_component_reply", out
        )
        self.check_out = self.node.create_publisher(msg.ArmingCheckRequest, "/fmu/out/arming_check_request", out)
        self.flags_out = self.node.create_publisher(msg.FailsafeFlags, "/fmu/out/failsafe_flags", out)
        for kind, name, callback in (
            (msg.OffboardControlMode, "offboard_control_mode", self.on_beat),
            (msg.VehicleThrustSetpoint, "vehicle_thrust_setpoint", self.on_thrust),
            (msg.VehicleTorqueSetpoint, "vehicle_torque_setpoint", self.on_torque),
            (msg.ActuatorMotors, "actuator_motors", self.on_motors),
            (msg.VehicleAttitudeSetpoint, "vehicle_attitude_setpoint_v1", self.on_attitude),
            (msg.VehicleCommand, "vehicle_command", self.on_command),
            (msg.RegisterExtComponentRequest, "register_ext_component_request", self.on_register),
            (msg.VehicleControlMode, "config_control_setpoints", self.on_config),
            (msg.ArmingCheckReply, "arming_check_reply_v1", self.on_check),
            (msg.UnregisterExtComponent, "unregister_ext_component", self.on_unregister),
        ):
            self.node.create_subscription(kind, f"/fmu/in/{name}", callback, into)

    @property
    def stream_lost(self):
        """Return whether the last heartbeat is too old."""
        return self.now - self.last_beat > LOSS

    def on_register(self, message):
        self.report.setdefault("names", []).append(bytes(message.name).rstrip(bytes(1)).decode())
        if not self.options["external"]:
            return
        reply = msg.RegisterExtComponentReply(timestamp=self.stamp(), request_id=message.request_id, name=message.name)
        reply.px4_ros2_api_version, reply.success = 1, self.options["external"] == "accepted"
        reply.mode_id, reply.arming_check_id = (EXTERNAL, 0) if reply.success else (-1, -1)
        self.registered = self.now if reply.success else 0.0
        self.reply_out.publish(reply)

    def on_config(self, message):
        if self.registered and message.source_id == EXTERNAL:
            self.config = message

    def on_check(self, message):
        needs = (message.mode_req_angular_velocity, message.mode_req_attitude, message.mode_req_local_position)
        if message.registration_id == 0 and message.request_id == self.checks[0] and all(needs):
            self.can_run, self.checks[1] = message.can_arm_and_run, message.request_id
            self.report.setdefault("checks", []).append([round(self.now, 3), message.can_arm_and_run])

    def on_unregister(self, message):
        if message.mode_id == EXTERNAL:
            self.registered = 0.0
            self.note("unregistered")

    def check_external(self):
        """Ask our mode three times a second whether it can run; one that does not answer is lost."""
        if not self.registered or self.now < self.check_at:
            return
        self.check_at = self.now + CHECK_EVERY
        if self.checks[0] - self.checks[1] > MISSES and self.nav_state == EXTERNAL and self.arming_state == ARMED:
            self.nav_state, self.failsafe = AUTO_LAND, True
            self.note("external mode lost")
        self.checks[0] += 1
        self.check_out.publish(msg.ArmingCheckRequest(timestamp=self.stamp(), request_id=self.checks[0]))
        if 0.0 < self.options["selected_after"] < self.now - self.registered:
            self.options["selected_after"], self.nav_state = 0.0, EXTERNAL
            self.note("selected")

    def on_beat(self, message):
        if self.stream_lost:
            self.beats = 0
        self.level = next((level for level in LEVELS if getattr(message, level)), "")
        self.beats, self.last_beat = self.beats + 1, self.now
        self.report["heartbeats"].append(round(self.now, 4))

    def on_thrust(self, message):
        self.thrust = np.array(message.xyz, dtype=float)
        self.setpoint_came(message.timestamp_sample)

    def on_torque(self, message):
        self.torque = np.array(message.xyz, dtype=float)
        torque, thrust = self.body.wrench(self.body.mix @ [*self.torque, -self.thrust[2]])
        if self.arming_state == ARMED:
            self.report["wrenches"].append([message.timestamp_sample, thrust, *torque])

    def on_motors(self, message):
        if not all(np.isnan(message.control[4:])):
            self.note("controls beyond the motors are not NaN")
        self.motors = np.array(message.control[:4], dtype=float)
        torque, thrust = self.body.wrench(self.motors)
        if self.arming_state == ARMED:
            self.report["wrenches"].append([message.timestamp_sample, thrust, *torque])
        self.setpoint_came(message.timestamp_sample)

    def on_attitude(self, message):
        self.attitude, self.attitude_thrust = self.body.matrix(message.q_d), -float(message.thrust_body[2])
        self.setpoint_came(0)

    def setpoint_came(self, sampled):
        self.report["setpoints"].append([round(self.now, 4), sampled])
        spooling = self.arming_state == ARMED and self.now - self.armed_at < SPOOL_UP
        if spooling and max(-self.thrust[2], *self.motors, self.attitude_thrust) > 0.01:
            self.report["idle_broken"] += 1

    def on_command(self, message):
        if message.target_system != 1 or message.target_component != 1:
            return
        self.note(f"command {message.command}")
        result = self.options["refused"].get(str(message.command))
        result = self.carry_out(message) if result is None else result
        self.acks.append((self.now + ACK_DELAY, message.command, result))

    def carry_out(self, message):
        """Return the result of a command."""
        if message.command == SET_MODE:
            if (message.param1, message.param2) != (1.0, 6.0):
                return 3
            if self.beats < BEATS or self.stream_lost:
                return 1
            self.nav_state = OFFBOARD
        elif message.command == SET_NAV_STATE:
            if message.param1 != EXTERNAL or not self.registered or self.config is None:
                return 1
            self.nav_state = EXTERNAL
        elif message.command == ARM and message.param1 == 0.0:
            if self.arming_state == ARMED and not self.body.on_ground and message.param2 != 21196.0:
                return 1
            self.arming_state = DISARMED
            self.note("disarmed")
        elif message.command == TAKEOFF:
            if self.arming_state != ARMED or not np.isnan(message.param7):
                return 1
            self.nav_state = AUTO_TAKEOFF
        elif message.command == ARM:
            ready = self.nav_state == OFFBOARD or (self.nav_state == EXTERNAL and self.can_run)
            if message.param1 != 1.0 or not ready or self.options["bad_preflight"]:
                return 1
            self.arming_state, self.armed_at = ARMED, self.now
        elif message.command == LAND:
            self.nav_state = AUTO_LAND
        else:
            return 3
        self.note(f"nav_state {self.nav_state}, arming_state {self.arming_state}")
        return 0

    def motor_commands(self):
        if self.arming_state != ARMED or self.now - self.armed_at < SPOOL_UP:
            return np.zeros(4)
        if self.nav_state in (AUTO_TAKEOFF, AUTO_LOITER):
            return self.body.climb(TAKEOFF_HEIGHT)
        if self.nav_state not in (OFFBOARD, EXTERNAL):
            return self.body.land()
        level = self.level
        if self.nav_state == EXTERNAL:
            level = "attitude" if self.config.flag_control_attitude_enabled else "thrust_and_torque"
        return {
            "thrust_and_torque": lambda: self.body.allocate(self.torque, self.thrust),
            "direct_actuator": lambda: np.clip(self.motors, 0.0, 1.0),
            "attitude": lambda: self.body.hold_attitude(self.attitude, self.attitude_thrust),
        }.get(level, lambda: np.zeros(4))()

    def step(self):
        """Go on by 4 ms."""
        options = self.options
        self.check_external()
        flying = self.arming_state == ARMED and self.nav_state in (OFFBOARD, EXTERNAL)
        self.flown_for += 0.004 if flying else 0.0
        if flying and self.stream_lost and self.nav_state == OFFBOARD:
            self.nav_state, self.failsafe = AUTO_LAND, True
            self.note("offboard lost")
        # right after a status: the next one is as far away as it can be
        if flying and self.now - self.said["status"][0] < 0.01 and self.happens("pilot_after"):
            self.nav_state = POSCTL
        if flying and self.happens("reset_after"):
            self.resets, self.shift = self.resets + 1, np.array([options["reset_by"], 0.0, 0.0])
        if flying and self.happens("battery_after"):
            options["battery"] = 0.05
        if self.nav_state == AUTO_TAKEOFF and -self.body.p[2] > TAKEOFF_HEIGHT - 0.2:
            self.nav_state = AUTO_LOITER
            self.note("took off")
        self.body.step(self.motor_commands())
        down = self.arming_state == ARMED and self.nav_state not in FLYING and self.body.on_ground
        self.landed_for = self.landed_for + 0.004 if down else 0.0
        if self.landed_for > 0.3:
            # seen on firmware: disarmed, it names the mode it was last asked for again
            self.arming_state, self.nav_state = DISARMED, OFFBOARD if self.beats else AUTO_LOITER
            self.note("disarmed")
        self.now += 0.004

    def publish(self):
        """Send what is due; odometry is 8, 12 or 16 ms apart."""
        if self.now >= self.next_sample:
            self.next_sample = self.now + (0.008, 0.012, 0.008, 0.008, 0.016)[self.samples % 5] - 1e-6
            self.samples += 1
            self.send_odometry()
        for due in [ack for ack in self.acks if ack[0] <= self.now]:
            self.acks.remove(due)
            to_us = {"target_system": 1, "target_component": 1}
            self.ack_out.publish(msg.VehicleCommandAck(timestamp=self.stamp(), command=due[1], result=due[2], **to_us))
            stations = msg.VehicleCommandAck(timestamp=self.stamp(), command=due[1], result=6, target_system=255)
            self.ack_out.publish(stations)  # to a ground station's command
        if self.stream_lost != self.flags.offboard_control_signal_lost or self.now > 1e-6 * self.flags.timestamp + 0.5:
            self.flags = msg.FailsafeFlags(
                timestamp=self.stamp(),
                attitude_invalid=self.options["bad_preflight"],
                offboard_control_signal_lost=self.stream_lost,
            )
        if round(self.now / 0.004) % 50 == 0:  # five times a second, whenever it changed
            self.flags_out.publish(self.flags)
        if self.is_due("landed", 0.1):
            idle = self.arming_state != ARMED or max(self.motor_commands()) < 0.3
            landed = bool(self.body.on_ground) and bool(idle)
            self.landed_out.publish(msg.VehicleLandDetected(timestamp=self.stamp(), landed=landed))
            self.battery_out.publish(
                msg.BatteryStatus(timestamp=self.stamp(), connected=True, remaining=self.options["battery"])
            )
        if self.is_due("control mode", 0.02):
            message = msg.VehicleControlMode(timestamp=self.stamp(), flag_armed=self.arming_state == ARMED)
            message.flag_control_offboard_enabled = self.nav_state == OFFBOARD
            message.source_id = EXTERNAL if self.nav_state == EXTERNAL else 0
            self.control_out.publish(message)
        if self.is_due("status", 0.2):
            self.status_out.publish(
                msg.VehicleStatus(
                    timestamp=self.stamp(),
                    arming_state=self.arming_state,
                    nav_state=self.nav_state,
                    failsafe=self.failsafe,
                    pre_flight_checks_pass=not self.options["bad_preflight"],
                )
            )

    def is_due(self, topic, interval):
        """Return whether to publish now: what changed, as soon as ``interval`` allows, and twice a second anyway."""
        at, last = self.said.get(topic, (-1.0, None))
        now = (self.nav_state, self.arming_state, self.failsafe)
        due = self.now - at >= (interval if now != last else 0.5) - 1e-6
        if due:
            self.said[topic] = (self.now, now)
        return due

    def stamp(self):
        return round(1e6 * self.now)

    def send_odometry(self):
        options, body = self.options, self.body
        if 0.0 < options["silent_after"] < self.flown_for or self.random.random() < options["drop"]:
            return
        message = msg.VehicleOdometry(timestamp=self.stamp() + 600, timestamp_sample=self.stamp())
        message.pose_frame = message.velocity_frame = 1
        told = self.told
        message.position, message.velocity = (told.p + self.shift).tolist(), told.v.tolist()
        message.q, message.angular_velocity = told.quaternion().tolist(), told.w.tolist()
        message.reset_counter = self.resets
        if options["nan_every"] and self.samples % options["nan_every"] == 0:
            message.position = [float("nan")] * 3
        held, self.held_back = self.held_back, None
        if held is None and self.random.random() < options["reorder"]:
            self.held_back = message
            return
        self.odometry_out.publish(message)
        if held is not None:
            self.odometry_out.publish(held)
        self.report["poses"].append([message.timestamp_sample, *(body.p).tolist()])

    def run(self, is_done):
        """Fly; where the machine is late, this clock waits: a burst of messages is no autopilot's."""
        began, steps = time.monotonic(), 0

        def catch_up():
            nonlocal began, steps
            began = max(began, time.monotonic() - 0.004 * (steps + 6))
            while began + 0.004 * steps <= time.monotonic():
                self.step()
                self.publish()
                steps += 1

        self.node.create_timer(0.004, catch_up, clock=Clock(clock_type=ClockType.STEADY_TIME))
        # An autopilot has a processor of its own.
        for task in Path("/proc/self/task").iterdir():
            with suppress(PermissionError, ProcessLookupError):
                os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(41))
        executor = EventsExecutor()
        executor.add_node(self.node)
        print("up", flush=True)
        while not is_done():
            executor.spin_until_future_complete(Future(), timeout_sec=0.2)


if __name__ == "__main__":
    FakePx4.serve()

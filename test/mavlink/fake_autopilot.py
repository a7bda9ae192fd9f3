"""An autopilot that can refuse, over MAVLink and UDP: python fake_autopilot.py PORT REPORT '{"option": value}'.

It is written from interface facts of PX4 and ArduPilot and imports nothing of the bridge. It cannot show an
estimator, true scale or true timing. It writes REPORT (JSON) when it is stopped. Times are s of its own clock.
"""

import math
import select
import socket
import sys
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "px4"))
from body import Body, Fake

OPTIONS = {
    "kind": "px4",  # or ardupilot
    "bad_preflight": False,
    "refused": {},  # {command: result}
    "drop": 0.0,
    "nan_every": 0,
    "child_frame": 1,  # of ODOMETRY's velocity
    "reset_after": 0.0,  # s of flight; 0: never
    "reset_by": 0.1,  # m
    "pilot_after": 0.0,
    "silent_after": 0.0,
    "frozen_after": 0.0,
    "battery_after": 0.0,
    "guid_options": 8,
    "angle_boost": 1,
    "stranger": False,  # another system speaks, too
}
FRESH = 0.5  # s for which a target is fresh
SET_MODE, ARM, LAND, INTERVAL = 176, 400, 21, 511
BEATS, OFFBOARD_LOSS, GUIDED_LOSS, GCS_LOSS = 20, 1.0, 3.0, 5.0
SPOOL, ACK_DELAY = 0.5, 0.02


def fault(m, now):
    """Return why a SET_ATTITUDE_TARGET is not obeyed."""
    numbers = [*m.q, m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate, m.thrust]
    age = now - 1e-3 * m.time_boot_ms
    checks = (
        ("target", (m.target_system, m.target_component) != (1, 1)),
        ("not finite", not all(map(math.isfinite, numbers))),
        ("type_mask", m.type_mask != 7),
        ("quaternion", abs(math.hypot(*m.q) - 1.0) > 1e-3),
        ("thrust", not 0.0 <= m.thrust <= 1.0),
        ("stale", not -0.05 <= age <= FRESH),
    )
    return next((name for name, wrong in checks if wrong), "")


class FakeAutopilot(Fake):
    """State machine, controllers and messages around a ``Body``."""

    def __init__(self, port, options):
        self.options = {**OPTIONS, **options}
        self.is_px4 = self.options["kind"] == "px4"
        self.body, self.random = Body(), np.random.default_rng(5)
        self.now, self.mode, self.armed, self.failsafe = 7.0, "loiter", False, False
        self.beats, self.last_beat, self.last_gcs = 0, -9.0, -9.0
        self.target, self.thrust = np.eye(3), 0.0
        self.armed_at = self.landed_for = self.flown_for = self.spooled = 0.0
        self.charge = 80  # percent
        self.acks, self.intervals, self.due, self.samples = [], {}, {}, 0
        self.resets, self.shift, self.other_clock = 0, np.zeros(3), False
        self.report = {"events": [], "refusals": [], "targets": [], "poses": [], "heartbeats": [], "idle_broken": 0}
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.peer = ("127.0.0.1", port)
        self.out = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self.other = mavlink.MAVLink(None, srcSystem=9, srcComponent=1)
        self.into = mavlink.MAVLink(None)
        self.into.robust_parsing = True

    def refuse(self, why):
        self.report["refusals"].append([round(self.now, 3), why])

    def send(self, message, codec=None):
        self.socket.sendto(message.pack(codec or self.out), self.peer)

    def say(self, text, severity=3):
        """Send a text; a long one goes in pieces of 50 with a number."""
        pieces = [text[i : i + 50] for i in range(0, len(text), 50)]
        for place, piece in enumerate(pieces):
            number = 77 if len(pieces) > 1 else 0
            self.send(mavlink.MAVLink_statustext_message(severity, piece.encode(), number, place))

    def take(self):
        """Handle what has come."""
        while select.select([self.socket], [], [], 0.0)[0]:
            try:
                data = self.socket.recv(2048)
            except OSError:
                continue
            for message in self.into.parse_buffer(data) or ():
                handler = {
                    "HEARTBEAT": self.on_heartbeat,
                    "SET_ATTITUDE_TARGET": self.on_target,
                    "COMMAND_LONG": self.on_command,
                    "PARAM_REQUEST_READ": self.on_parameter,
                }.get(message.get_type())
                if handler:
                    handler(message)

    def on_heartbeat(self, message):
        self.report["heartbeats"].append(round(self.now, 3))
        if message.autopilot == 8 and message.type in (6, 18):
            self.last_gcs = self.now

    def on_parameter(self, message):
        values = {"GUID_OPTIONS": self.options["guid_options"], "ATC_ANGLE_BOOST": self.options["angle_boost"]}
        if not self.is_px4 and message.param_id in values:
            self.send(
                mavlink.MAVLink_param_value_message(message.param_id.encode(), values[message.param_id], 4, 900, 7)
            )

    def on_target(self, message):
        why = fault(message, self.now)
        if why:
            self.refuse(why)
            return
        self.beats = self.beats + 1 if self.now - self.last_beat <= FRESH else 1
        self.last_beat = self.now
        self.thrust = message.thrust
        self.target = self.body.matrix(message.q)
        spooling = self.armed and self.now - self.armed_at < 1.0
        self.report["idle_broken"] += int(spooling and self.is_px4 and self.thrust > 0.01)
        self.report["targets"].append([round(self.now, 4), message.type_mask, message.time_boot_ms])

    def on_command(self, message):
        if (message.target_system, message.target_component) != (1, 1):
            self.refuse("target")
            return
        if message.command == INTERVAL:
            self.intervals[int(message.param1)] = 1e-6 * message.param2
            result = 0
        else:
            self.note(f"command {message.command}")
            result = self.options["refused"].get(str(message.command))
            result = self.carry_out(message) if result is None else result
        self.acks.append((self.now + ACK_DELAY, message.command, result, message.get_srcSystem()))

    def carry_out(self, m):
        """Return the result of a command."""
        if m.command == SET_MODE:
            if (m.param1, m.param2) != (1.0, 6.0 if self.is_px4 else 4.0):
                return 2
            if self.is_px4 and (self.beats < BEATS or self.now - self.last_beat > FRESH):
                self.say("Offboard: no stream of setpoints", 4)
                return 1
            self.mode = "ours"
        elif m.command == ARM and m.param1 == 0.0 and self.body.on_ground:
            self.armed = False
            self.note("disarmed")
            return 0
        elif m.command == ARM:
            if m.param1 != 1.0 or m.param2 == 21196.0 or self.mode != "ours":
                return 1 if self.is_px4 else 4
            if self.options["bad_preflight"]:
                self.say("Preflight Fail: Compass Sensor 0 missing and nothing else can be said about it")
                return 1 if self.is_px4 else 4
            if self.now - self.last_gcs > 3.0:
                self.say("Preflight Fail: no heartbeat")
                return 1
            self.armed, self.armed_at = True, self.now
        elif m.command == LAND:
            self.mode = "land"
        else:
            return 3
        self.note(f"{self.mode}{', armed' if self.armed else ''}")
        return 0

    def motors(self):
        """Return the commands of the four motors."""
        if not self.armed or self.now - self.armed_at < (1.0 if self.is_px4 else SPOOL):
            return np.zeros(4)
        if self.mode != "ours":
            return self.body.land()
        thrust, late = self.thrust, self.now - self.last_beat > GUIDED_LOSS
        if not self.is_px4:
            if late or not self.options["guid_options"] & 8:
                return self.body.land()
            thrust = thrust / min(max(self.target[2, 2], 0.1), 1.0) if self.options["angle_boost"] else thrust
        return self.body.hold_attitude(self.target, thrust)

    def step(self):
        """Go on by 4 ms."""
        options, flying = self.options, self.armed and self.mode == "ours"
        self.flown_for += 0.004 if flying else 0.0
        if flying and self.is_px4 and self.now - self.last_beat > OFFBOARD_LOSS:
            self.mode, self.failsafe = "land", True
            self.note("offboard lost")
        if flying and not self.is_px4 and self.now - self.last_gcs > GCS_LOSS:
            self.mode, self.failsafe = "land", True
            self.note("GCS lost")
        if flying and self.happens("pilot_after"):
            self.mode = "pilot"
        if flying and self.happens("battery_after"):
            self.charge = 5
        if flying and self.happens("reset_after"):
            self.resets, self.shift = self.resets + 1, np.array([options["reset_by"], 0.0, 0.0])
        self.body.step(self.motors())
        down = self.armed and self.mode != "ours" and self.body.on_ground
        self.landed_for = self.landed_for + 0.004 if down else 0.0
        if self.landed_for > 0.3:
            self.armed = False
            self.note("disarmed")
        self.now += 0.004

    def is_due(self, identity, default=None):
        interval = self.intervals.get(identity, default)
        if interval is None or self.now + 1e-6 < self.due.get(identity, 0.0):
            return False
        self.due[identity] = max(self.due.get(identity, 0.0) + interval, self.now - interval)
        return True

    def publish(self):
        """Send what is due."""
        if self.is_due(0, 1.0):
            self.send_heartbeat(self.out)
            if self.options["stranger"]:
                self.send_heartbeat(self.other)
        for ack in [ack for ack in self.acks if ack[0] <= self.now]:
            self.acks.remove(ack)
            self.send(mavlink.MAVLink_command_ack_message(ack[1], ack[2], 0, 0, ack[3], 191))
        if self.is_due(1):
            health = 0 if self.options["bad_preflight"] else 0x10000000
            self.send(
                mavlink.MAVLink_sys_status_message(0, 0x10000000, health, 0, 11800, 0, self.charge, 0, 0, 0, 0, 0, 0)
            )
        if self.is_due(245):
            self.send(mavlink.MAVLink_extended_sys_state_message(0, 1 if self.body.on_ground else 2))
        silent = 0.0 < self.options["silent_after"] < self.flown_for
        for identity, sender in ((331, self.send_odometry), (32, self.send_position), (31, self.send_attitude)):
            due = (identity == 331) == self.is_px4 and self.is_due(identity) and not silent
            if due and self.random.random() >= self.options["drop"]:
                sender()

    def send_heartbeat(self, codec):
        px4 = {"ours": 6 << 16, "land": 4 << 16 | 6 << 24, "pilot": 3 << 16, "loiter": 4 << 16 | 3 << 24}
        copter = {"ours": 4, "land": 9, "pilot": 5, "loiter": 5}
        mode = (px4 if self.is_px4 else copter)[self.mode]
        status = 5 if self.failsafe else 4 if self.armed else 3
        kind = 12 if self.is_px4 else 3
        self.send(mavlink.MAVLink_heartbeat_message(2, kind, 1 | (128 if self.armed else 0), mode, status, 3), codec)

    def sampled(self):
        p = self.told.p + self.shift
        self.samples += 1
        self.report["poses"].append([round(1e6 * self.now), *self.body.p.tolist()])
        if self.options["nan_every"] and self.samples % self.options["nan_every"] == 0:
            p = p * math.nan
        return p

    def send_odometry(self):
        p, child = self.sampled(), self.options["child_frame"]
        told = self.told
        v = told.v if child == 1 else told.r.T @ told.v
        q, nothing = told.quaternion(), [math.nan] * 21
        stamp = round(1e6 * self.now)
        self.send(
            mavlink.MAVLink_odometry_message(stamp, 1, child, *p, q, *v, *told.w, nothing, nothing, self.resets, 8, 0)
        )

    def send_position(self):
        self.send(mavlink.MAVLink_local_position_ned_message(round(1e3 * self.now), *self.sampled(), *self.told.v))

    def send_attitude(self):
        q = self.told.quaternion()
        self.send(mavlink.MAVLink_attitude_quaternion_message(round(1e3 * self.now), *q, *self.told.w))

    def turn(self):
        """Take what came and go one step on."""
        self.take()
        self.step()
        self.publish()


if __name__ == "__main__":
    FakeAutopilot.serve()

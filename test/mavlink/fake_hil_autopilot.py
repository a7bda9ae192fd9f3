"""An autopilot for the simulator's side of MAVLink: boots, checks what it is told, hovers on its sensors, lands.

Written from MAVLink's definition of the HIL messages and from what PX4 does; it imports nothing of the plant's side. It
estimates in NED/FRD by itself: gyro integrated, GPS and barometer as corrections, compass for the first heading.
Usage: fake_hil_autopilot.py PORT REPORT OPTIONS(JSON)
"""

import json
import math
import select
import socket
import sys
import time
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

OPTIONS = {
    "boot": 40, "rest": 250, "hover": 3.0, "height": 2.0, "nan_at": 0, "silent_at": 0, "late_at": 0, "ahead_at": 0,
    "leave_at": 0, "lockstep": 1, "garbage": 0, "declination": 3.5, "heading": 90.0, "never": 0,
}  # fmt: skip
MASS, G, ARM, KM, LARGEST = 2.064, 9.81, 0.246 * math.sqrt(0.5), 0.016, 8.5487
J = np.array([0.02362, 0.02362, 0.0439])
ROTORS = [(ARM, ARM, KM), (-ARM, -ARM, KM), (ARM, -ARM, -KM), (-ARM, ARM, -KM)]
ALLOCATION = np.linalg.inv(np.array([[-py, px, km, 1.0] for px, py, km in ROTORS]).T)
EARTH = 6371000.0


def turn(v):
    """Return the rotation matrix of a rotation vector in rad."""
    angle = np.linalg.norm(v)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = v / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


class Estimate:
    """Attitude R (FRD to NED), velocity and position in NED, from sensors alone."""

    def __init__(self, declination):
        self.declination = declination
        self.r, self.v, self.p = np.eye(3), np.zeros(3), np.zeros(3)
        self.force, self.omega = np.zeros(3), np.zeros(3)
        self.resting, self.fields, self.first, self.ground = [], [], None, None

    def rest(self, sensor):
        self.resting.append([sensor.xgyro, sensor.ygyro, sensor.zgyro, sensor.xacc, sensor.yacc, sensor.zacc])
        if sensor.fields_updated & 0x1C0:
            self.fields.append([sensor.xmag, sensor.ymag, sensor.zmag])

    def level(self):
        mean = np.mean(self.resting, axis=0)
        self.bias, (x, y, z) = mean[:3], mean[3:]
        roll, pitch = math.atan2(-y, -z), math.atan2(x, math.hypot(y, z))
        lean = turn([0.0, pitch, 0.0]) @ turn([roll, 0.0, 0.0])
        north, east, _ = lean @ np.mean(self.fields, axis=0)
        yaw = math.atan2(-east, north) + math.radians(self.declination)
        self.r = turn([0.0, 0.0, yaw]) @ lean

    def move(self, sensor, dt):
        self.omega = np.array([sensor.xgyro, sensor.ygyro, sensor.zgyro]) - self.bias
        self.r = self.r @ turn(dt * self.omega)
        self.v = self.v + dt * (self.r @ [sensor.xacc, sensor.yacc, sensor.zacc] + [0.0, 0.0, G])
        self.p = self.p + dt * self.v

    def air(self, sensor):
        if sensor.fields_updated & 0x1A00:
            height = 44330.8 * (1.0 - (sensor.abs_pressure / 1013.25) ** 0.190263)
            self.ground = height if self.ground is None else self.ground
            self.p[2] += 0.1 * (self.ground - height - self.p[2])

    def fix(self, gps):
        place = np.radians([1e-7 * gps.lat, 1e-7 * gps.lon])
        self.first = place if self.first is None else self.first
        moved = EARTH * (place - self.first) * [1.0, math.cos(self.first[0])]
        self.p[:2] += 0.1 * (moved - self.p[:2])
        self.v += 0.3 * (0.01 * np.array([gps.vn, gps.ve, gps.vd]) - self.v)


def controls(estimate, height, heading):
    """Return motor outputs 0..1 that go to ``height`` m above the start."""
    error = np.array([0.0, 0.0, -height]) - estimate.p
    wanted = np.clip(3.0 * error - 3.0 * estimate.v, -2.5, 2.5) - [0.0, 0.0, G]
    down = -wanted / np.linalg.norm(wanted)
    right = np.cross(down, [math.cos(heading), math.sin(heading), 0.0])
    right /= np.linalg.norm(right)
    goal = np.array([np.cross(right, down), right, down]).T
    skew = goal.T @ estimate.r - estimate.r.T @ goal
    tilt = 0.5 * np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    torque = J * np.array([20.0, 20.0, 5.0]) * (-6.0 * tilt * [1.0, 1.0, 0.5] - estimate.omega)
    thrust = MASS * np.linalg.norm(wanted)
    return np.clip(ALLOCATION @ [*torque, thrust] / LARGEST, 0.0, 1.0)


class Autopilot:
    def __init__(self, port, options):
        self.options = {**OPTIONS, **options}
        self.wrong, self.heights, self.errors = [], [], []
        self.estimate = Estimate(self.options["declination"])
        self.heading = math.radians(self.options["heading"])
        self.steps, self.last, self.truth, self.answered = 0, None, None, 0
        self.codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self.codec.robust_parsing = True
        self.socket = self.connected(port)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.send(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 0, 3))
        self.send(mavlink.MAVLink_command_long_message(0, 0, 511, 0, 115, 5e3, 0, 0, 0, 0, 0))
        if self.options["garbage"]:
            self.socket.sendall(bytes(range(256)))

    def connected(self, port):
        until = time.monotonic() + 60.0
        while time.monotonic() < until:
            link = socket.socket()
            if link.connect_ex(("127.0.0.1", port)) == 0:
                return link
            link.close()
            time.sleep(0.05)
        raise SystemExit("nobody listens")

    def send(self, message):
        self.socket.sendall(message.pack(self.codec))

    def expect(self, is_right, what):
        if not is_right and len(self.wrong) < 20:
            self.wrong.append(f"step {self.steps}: {what}")

    def check_rest(self, sensor):
        options = self.options
        self.expect(abs(sensor.zacc + G) < 0.6, f"at rest zacc is {sensor.zacc:.2f}, expected -9.81")
        self.expect(abs(sensor.xacc) < 0.6 and abs(sensor.yacc) < 0.6, "at rest it feels a sideways force")
        self.expect(sensor.fields_updated & 0x3F == 0x3F, "gyro and accelerometer are not marked as new")
        if sensor.fields_updated & 0x1C0:
            self.expect(sensor.zmag > 0.2, f"zmag is {sensor.zmag:.3f}, expected down in Europe")
            field = math.degrees(math.atan2(-sensor.ymag, sensor.xmag)) + options["declination"]
            away = (field - options["heading"] + 180.0) % 360.0 - 180.0
            self.expect(abs(away) < 15.0, f"the compass says {field:.0f} deg, expected {options['heading']:.0f}")
        if sensor.fields_updated & 0x1A00:
            self.expect(abs(sensor.abs_pressure - 955.9) < 2.0, f"pressure is {sensor.abs_pressure:.1f} hPa")
            self.expect(abs(sensor.pressure_alt - 488.0) < 5.0, f"pressure altitude is {sensor.pressure_alt:.1f} m")

    def check_gps(self, gps):
        self.expect(gps.fix_type == 3 and 0 < gps.eph < 300 and 0 < gps.epv < 500, "no fix to fly on")
        self.expect(abs(gps.lat - 473977420) < 5000 and abs(gps.lon - 85455940) < 5000, "GPS is far from home")
        self.expect(abs(gps.alt - 488_000) < 20_000, f"GPS altitude is {gps.alt}")

    def on_sensor(self, sensor):
        """Return whether to go on."""
        options = self.options
        self.steps += 1
        if self.last is not None:
            self.expect(sensor.time_usec - self.last == 4000, f"time went from {self.last} to {sensor.time_usec}")
        self.last = sensor.time_usec
        if self.steps <= options["boot"] or options["never"]:
            return True
        self.answered += 1
        estimate, rest = self.estimate, options["rest"]
        estimate.air(sensor)
        flown = 0.004 * (self.answered - rest)
        if self.answered <= rest:
            if self.answered > 60:  # it has settled on its feet
                self.check_rest(sensor)
                estimate.rest(sensor)
            if self.answered == rest:
                estimate.level()
            return self.answer(sensor.time_usec, np.zeros(4), armed=False)
        estimate.move(sensor, 0.004)
        climb, hover = 2.0, options["hover"]
        if flown < climb + hover:
            height = options["height"] * min(flown / climb, 1.0)
        else:
            height = options["height"] - 0.7 * (flown - climb - hover)
        if flown > climb + 1.0 and height >= options["height"] and self.truth is not None:
            self.heights.append(self.truth)
            self.errors.append(float(np.linalg.norm(estimate.p - [0.0, 0.0, -self.truth])))
        if height < -0.3:
            self.answer(sensor.time_usec, np.zeros(4), armed=False)
            return False
        return self.answer(sensor.time_usec, controls(estimate, height, self.heading), armed=True)

    def answer(self, time_usec, motors, armed):
        options, at = self.options, self.answered
        if at == options["leave_at"]:
            return False
        if at == options["silent_at"]:
            time.sleep(60.0)
        motors = [*motors, *[0.0] * 12]
        if at == options["nan_at"]:
            motors[2] = math.nan
        if at == options["late_at"]:
            self.controls(time_usec - 4000, motors, armed)
            time.sleep(0.2)
            self.expect(not select.select([self.socket], [], [], 0)[0], "the plant went on without an answer")
        if at == options["ahead_at"]:
            time_usec += 4000
        if at % 50 == 0:
            time.sleep(0.005)
            self.expect(not select.select([self.socket], [], [], 0)[0], "sensors came before the answer")
        self.controls(time_usec, motors, armed)
        return True

    def controls(self, time_usec, motors, armed):
        mode = 129 if armed else 1
        self.send(mavlink.MAVLink_hil_actuator_controls_message(time_usec, motors, mode, self.options["lockstep"]))

    def on_message(self, message):
        kind = message.get_type()
        if kind == "HIL_SENSOR":
            return self.on_sensor(message)
        if kind == "HIL_GPS":
            self.check_gps(message)
            self.estimate.fix(message)
        elif kind == "HIL_STATE_QUATERNION":
            self.truth = 1e-3 * message.alt - 488.0 - 0.1
        return True

    def run(self):
        while data := self.socket.recv(65536):
            for message in self.codec.parse_buffer(data) or ():
                if not self.on_message(message):
                    return


def main():
    port, report, options = sys.argv[1:]
    autopilot = Autopilot(int(port), json.loads(options))
    try:
        autopilot.run()
    except ConnectionError:
        autopilot.wrong.append("the plant closed the connection")
    found = {
        "answered": autopilot.answered, "wrong": autopilot.wrong, "heights": autopilot.heights[::25],
        "errors": autopilot.errors[::25],
    }  # fmt: skip
    Path(report).write_text(json.dumps(found), "utf-8")
    autopilot.socket.close()


if __name__ == "__main__":
    main()

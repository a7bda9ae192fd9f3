"""A Crazyflie that can refuse, over CRTP and UDP: python fake_crazyflie.py PORT REPORT '{"option": value}'.

It is written from interface facts and imports nothing of the bridge nor of cflib. It cannot show an estimator, a radio,
true scale or true timing: its body is that of a 2 kg vehicle. It writes REPORT (JSON) when it is stopped.
"""

import math
import select
import socket
import struct
import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "px4"))
from body import Body, Fake

OPTIONS = {
    "cannot_arm": False, "silent_after": 0.0, "frozen_after": 0.0, "pilot_after": 0.0, "battery_after": 0.0,
    "reset_after": 0.0, "reset_by": 0.0,
}  # fmt: skip
PARAM, RPYT, MEM, LOG, GENERIC, HIGH_LEVEL, SUPERVISOR, PLATFORM, LINK = 2, 3, 4, 5, 7, 8, 9, 13, 15
MANUAL, LAND, HL_STOP = 11, 8, 3
LEVEL_AFTER, OFF_AFTER = 0.5, 2.0
TYPES = {"H": 2, "h": 5, "I": 3}  # struct: CRTP log type
NAMES = [f"stateEstimateZ.{name}" for name in ("x", "y", "z", "vx", "vy", "vz", "rateRoll", "ratePitch", "rateYaw")]
VARIABLES = [(name, "h") for name in NAMES] + [
    ("stateEstimateZ.quat", "I"), ("pm.vbatMV", "H"), ("supervisor.info", "H"),
]  # fmt: skip
WORLD, FLU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]), np.diag([1.0, -1.0, -1.0])


def packed(q):
    """Return a quaternion xyzw in 32 bits."""
    largest = int(np.argmax(np.abs(q)))
    q = q * (1.0 if q[largest] >= 0.0 else -1.0)
    bits = largest
    for place in range(4):
        if place != largest:
            bits = bits << 10 | int(q[place] < 0.0) << 9 | int(511 * abs(q[place]) * math.sqrt(2.0) + 0.5)
    return bits


class FakeCrazyflie(Fake):
    """Commander, supervisor and log around a ``Body``."""

    def __init__(self, port, options):
        self.options, self.body = {**OPTIONS, **options}, Body()
        self.now, self.peer, self.block, self.next_block = 3.0, None, None, 0.0
        self.identity, self.period = 0, 0.0
        self.armed = self.unlocked = self.locked = False
        self.angles, self.thrust, self.yaw, self.last = (0.0, 0.0), 0.0, 0.0, -9.0
        self.released, self.landing = True, None
        self.flown_for, self.millivolts, self.shift, self.taken = 0.0, 3900, np.zeros(3), False
        self.report = {"events": [], "refusals": [], "manual": [], "poses": []}
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.socket.setblocking(False)

    def refuse(self, why):
        self.report["refusals"].append(why)

    def send(self, port, channel, data):
        if self.peer:
            self.socket.sendto(bytes([port << 4 | 3 << 2 | channel]) + bytes(data), self.peer)

    def take(self):
        """Handle what has come."""
        while select.select([self.socket], [], [], 0.0)[0]:
            data, self.peer = self.socket.recvfrom(64)
            port, channel, data = data[0] >> 4, data[0] & 3, data[1:]
            handler = {
                LINK: self.on_link, PLATFORM: self.on_platform, LOG: self.on_log, MEM: self.on_memory,
                PARAM: self.on_param, RPYT: self.on_rpyt, GENERIC: self.on_generic, HIGH_LEVEL: self.on_high_level,
                SUPERVISOR: self.on_supervisor,
            }.get(port)  # fmt: skip
            if handler:
                handler(channel, data)

    def on_link(self, channel, data):
        self.send(LINK, channel, data if channel == 0 else b"Bitcraze Crazyflie\0")

    def on_platform(self, channel, data):
        if channel == 1 and data[:1] == b"\0":
            self.send(PLATFORM, 1, [0, 12])

    def on_memory(self, channel, data):
        if channel == 0 and data[0] == 1:
            self.send(MEM, 0, [1, 0])

    def on_param(self, channel, data):
        if channel == 0 and data[0] == 3:
            self.send(PARAM, 0, struct.pack("<BHI", 3, 0, 0x1234))

    def on_log(self, channel, data):
        if channel == 0 and data[0] == 3:
            self.send(LOG, 0, struct.pack("<BHIBB", 3, len(VARIABLES), 0x5678, 16, 128))
        elif channel == 0 and data[0] == 2:
            place = data[1] | data[2] << 8
            name, kind = VARIABLES[place]
            text = name.replace(".", "\0").encode() + b"\0"
            self.send(LOG, 0, struct.pack("<BHB", 2, place, TYPES[kind]) + text)
        elif channel == 1 and data[0] == 5:
            self.send(LOG, 1, [5, 0, 0])
        elif channel == 1 and data[0] in (6, 7):
            chosen = [data[i + 1] | data[i + 2] << 8 for i in range(2, len(data) - 2, 3)]
            self.block = (self.block or []) + chosen if data[0] == 7 else chosen
            self.send(LOG, 1, [data[0], data[1], 0])
        elif channel == 1 and data[0] == 3:
            self.identity, self.period, self.next_block = data[1], 0.01 * data[2], self.now
            self.send(LOG, 1, [3, data[1], 0])

    def on_supervisor(self, channel, data):
        if channel == 1 and data[0] == 1:
            refused = self.options["cannot_arm"] or self.locked
            self.armed = bool(data[1]) and not refused
            self.note("armed" if self.armed else "arming refused" if data[1] else "disarmed")
            self.send(SUPERVISOR, 1, [0x81, not refused, self.armed])

    def on_rpyt(self, _, data):
        *_, thrust = struct.unpack("<fffH", data)
        self.last, self.released = self.now, False
        if thrust == 0:
            self.unlocked, self.thrust = True, 0.0
        else:
            self.refuse("rpyt thrust")

    def on_generic(self, channel, data):
        if channel == 1 and data[0] == 0:
            self.released = True
        if channel == 1 or self.taken:
            return
        if channel != 0 or data[0] != MANUAL or len(data) != 16:
            self.refuse(f"type {data[0]}")
            return
        roll, pitch, rate, thrust, by_rate = struct.unpack("<fffHB", data[1:])
        if by_rate or not all(map(math.isfinite, (roll, pitch, rate))) or not 10001 <= thrust <= 60000:
            self.refuse("manual")
        elif not self.unlocked:
            self.refuse("thrust is locked")
        else:
            self.last, self.released, self.landing = self.now, False, None
            self.angles, self.rate, self.thrust = (
                (math.radians(roll), math.radians(pitch)),
                math.radians(rate),
                thrust / 65535.0,
            )
            self.report["manual"].append([round(self.now, 3), roll, pitch, rate, thrust])

    def on_high_level(self, _, data):
        if data[0] == LAND and not self.released:
            self.refuse("land without notify_setpoint_stop")
        elif data[0] == LAND:
            _, _, height, _, _, duration = struct.unpack("<BBff?f", data)
            self.landing = (self.now, duration)
            self.note(f"land to {height:g}")
        elif data[0] == HL_STOP:
            self.landing = None
            self.thrust = 0.0
            self.note("stop")

    def motors(self):
        """Return the commands of the four motors."""
        if not self.armed or self.locked:
            return np.zeros(4)
        if self.landing:
            return self.body.land()
        age = self.now - self.last
        if age > OFF_AFTER and not self.body.on_ground:
            self.locked = True
            self.note("watchdog: off and locked")
        if self.thrust == 0.0:
            return np.zeros(4)
        roll, pitch = self.angles if age <= LEVEL_AFTER else (0.0, 0.0)
        rate = self.rate if age <= LEVEL_AFTER else 0.0
        self.yaw += 0.004 * rate
        # on the wire pitch > 0 is nose up; in FLU, about y to the left, it is nose down
        flu = Rotation.from_euler("ZYX", [self.yaw, -pitch, roll])
        return self.body.hold_attitude(WORLD @ flu.as_matrix() @ FLU, self.thrust)

    def info(self):
        flying = self.armed and max(self.body.thrusts) > 0.05
        bits = (not self.options["cannot_arm"], self.armed, False, self.armed, flying, False, self.locked)
        return sum(bool(bit) << place for place, bit in enumerate(bits)) | bool(self.landing) << 8

    def step(self):
        """Go on by 4 ms."""
        self.flown_for += 0.004 * bool(self.thrust)
        if self.happens("battery_after"):
            self.millivolts = 3000
        if self.happens("reset_after"):
            self.shift = np.array([self.options["reset_by"], 0.0, 0.0])
        if self.happens("pilot_after"):
            self.landing, self.taken = (self.now, 5.0), True  # another commander takes the vehicle, and lands it
        self.body.step(self.motors())
        self.now += 0.004
        silent = 0.0 < self.options["silent_after"] < self.flown_for
        if self.period and self.now >= self.next_block and not silent:
            self.next_block += self.period
            self.publish()

    def publish(self):
        body = self.told
        q = body.quaternion()  # wxyz, FRD in NED
        s = math.sqrt(0.5)
        enu = np.array([-s * (q[1] + q[2]), s * (q[2] - q[1]), s * (q[3] - q[0]), -s * (q[0] + q[3])])
        p, v, w = WORLD @ (body.p + self.shift), WORLD @ body.v, FLU @ body.w
        numbers = [*(1e3 * p), *(1e3 * v), 1e3 * w[0], -1e3 * w[1], 1e3 * w[2]]
        values = [int(np.clip(round(x), -32768, 32767)) for x in numbers]
        values += [packed(enu), self.millivolts, self.info()]
        data = b"".join(struct.pack("<" + VARIABLES[place][1], values[place]) for place in self.block)
        stamp = round(1e3 * self.now)
        self.report["poses"].append([stamp, *(WORLD @ self.body.p).tolist()])
        self.send(LOG, 2, struct.pack("<BI", self.identity, stamp)[:4] + data)

    def turn(self):
        """Take what came and go one step on."""
        self.take()
        self.step()


if __name__ == "__main__":
    FakeCrazyflie.serve()

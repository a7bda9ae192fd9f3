"""A vehicle of your own in place of the simulator, on rclpy and quad_msgs: a rigid body in both clocks.

Fly it: scripts/fly hover --own simulator="python3 examples/own_nodes/vehicle.py"
"""

import time
import zlib

import numpy as np
import rclpy
import rclpy.executors
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future

from quad_msgs.msg import Actuation, FlightPlan, FlightState, NodeStatus, RecorderAck, VehicleState
from quad_node.handshake import interface_hash

WEIGHT = np.array([0.0, 0.0, -9.8])  # m/s^2
WINDOW, SILENCE = 60, 100  # steps ahead of the recorder; ticks of 20 ms without an answer
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STEPS = QoSProfile(depth=256)


class Vehicle(Node):
    """Sends state, actuation, flight/state and its status; no truth, no disturbance, no odometry, no clock."""

    def __init__(self):
        super().__init__("simulator")
        given = {
            name: self.declare_parameter(name, default).value
            for name, default in {
                "flight.run_id": "",
                "flight.mode": "lockstep",
                "flight.plant_period": 2_000_000,
                "flight.roles": "simulator,trajectory,position_controller,attitude_controller,recorder",
                "vehicle.mass": 0.56,
                "vehicle.inertia_xx": 3.5e-3,
                "vehicle.inertia_yy": 3.5e-3,
                "vehicle.inertia_zz": 7.0e-3,
            }.items()
        }
        self.run_id, mode, self.period, roles, self.mass, *inertia = given.values()
        self.run = zlib.crc32(self.run_id.encode())  # whose messages these are
        self.inertia = np.array(inertia)
        self.lockstep, self.others = mode == "lockstep", set(roles.split(",")) - {"simulator"}
        self.p, self.v, self.omega, self.q = np.zeros(3), np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
        self.phase, self.reason, self.over, self.began = FlightState.WAITING, "", Future(), 0.0
        self.step = self.end_step = self.quiet = self.ticks = 0
        self.recorded, self.status, self.wrench = -1, {}, None
        self.state_out = self.create_publisher(VehicleState, "state", STEPS)
        self.actuation_out = self.create_publisher(Actuation, "actuation", STEPS)
        self.flight_out = self.create_publisher(FlightState, "flight/state", LATCHED)
        self.status_out = self.create_publisher(NodeStatus, "flight/nodes", LATCHED)
        self.create_subscription(WrenchStamped, "wrench_setpoint", self.on_wrench, STEPS)
        latched = QoSProfile(depth=64, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(NodeStatus, "flight/nodes", self.on_status, latched)
        self.create_subscription(FlightPlan, "flight/plan", self.on_plan, LATCHED)
        self.create_subscription(RecorderAck, "flight/recorded", self.on_recorded, 10)
        self.tell(NodeStatus.READY)
        self.create_timer(0.02, self.on_tick)

    def tell(self, state):
        fields = {
            "node": self.get_fully_qualified_name(),
            "role": "simulator",
            "run_id": self.run_id,
            "interface_hash": interface_hash(),
        }
        self.status_out.publish(NodeStatus(state=state, period_steps=1, plant_period=self.period, **fields))

    def publish_phase(self):
        fields = {"step": self.step, "end_step": self.end_step, "run": self.run, "reason": self.reason}
        fields["wall_time"] = time.monotonic() - self.began if self.began else 0.0
        self.flight_out.publish(FlightState(state=self.phase, stamp=self.stamp(self.step), **fields))

    def stamp(self, step):
        return rclpy.time.Time(nanoseconds=step * self.period).to_msg()

    def publish_state(self):
        if self.phase != FlightState.FLYING:
            return
        body = {"p_w": self.p, "v_w": self.v, "q_wb": self.q, "omega_b": self.omega}
        self.state_out.publish(VehicleState(stamp=self.stamp(self.step), step=self.step, run=self.run, **body))

    def on_status(self, message):
        if message.run_id == self.run_id:
            self.status[message.role] = message.state

    def on_plan(self, message):
        if message.run == self.run:
            self.end_step = self.end_step or message.end_step
            self.go_on()

    def on_recorded(self, message):
        if message.run == self.run:
            self.recorded = message.step
            self.go_on()

    def on_wrench(self, message):
        stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        force, torque = message.wrench.force, message.wrench.torque
        command = np.array([force.z, torque.x, torque.y, torque.z])
        if np.isfinite(command).all() and not (self.lockstep and stamp != self.step * self.period):
            self.wrench, self.quiet = command, 0
            self.go_on()

    def go_on(self):  # lockstep: the answer to this step, the plan and the recorder let the vehicle go on
        behind = "recorder" in self.others and self.step > self.recorded + WINDOW
        answered = self.wrench is not None and self.end_step > 0
        if self.lockstep and self.phase == FlightState.FLYING and answered and not behind:
            self.integrate()
            self.publish_state()

    def integrate(self):
        dt, (thrust, *torque) = self.period * 1e-9, self.wrench
        x, y, z, w = self.q
        up = np.array([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])
        self.v = self.v + dt * (thrust / self.mass * up + WEIGHT)
        self.p = self.p + dt * self.v
        self.omega = self.omega + dt * (torque - np.cross(self.omega, self.inertia * self.omega)) / self.inertia
        a, b, c = 0.5 * dt * self.omega
        turn = [w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a, -x * a - y * b - z * c]
        turned = self.q + np.array(turn)
        self.q = turned / np.linalg.norm(turned)
        made = {"thrust": float(thrust), "torque_b": np.array(torque)}
        self.actuation_out.publish(Actuation(stamp=self.stamp(self.step), step=self.step, run=self.run, **made))
        if self.end_step and self.step + 1 >= self.end_step:
            self.end(FlightState.ENDED)
            return
        self.step, self.wrench = self.step + 1, None if self.lockstep else self.wrench

    def on_period(self):  # real time: the clock goes on, with the newest wrench
        if self.wrench is None:  # time begins with the first command
            self.began = time.monotonic()
        due, before = int((time.monotonic() - self.began) * 1e9) // self.period, self.step
        while self.phase == FlightState.FLYING and self.wrench is not None and self.step < due:
            self.integrate()
        if self.step > before:  # the state of a step is sent once
            self.publish_state()

    def on_tick(self):
        self.ticks += 1
        if self.phase == FlightState.WAITING:
            missing = self.others - {role for role, state in self.status.items() if state in (1, 2)}
            missing |= {"readers of state"} if self.state_out.get_subscription_count() < len(self.others) else set()
            self.reason = "waiting for " + ", ".join(missing)
            if not missing:
                self.phase, self.reason, self.began = FlightState.FLYING, "", time.monotonic()
                self.publish_phase()
                self.publish_state()
                if not self.lockstep:
                    self.clock = self.create_timer(self.period * 1e-9, self.on_period)
        elif self.phase == FlightState.FLYING:
            self.quiet += 1
            failed = [role for role, state in self.status.items() if state == NodeStatus.FAULT]
            if failed or self.quiet > SILENCE:
                self.end(FlightState.FAILED, f"{', '.join(failed) or 'attitude_controller'}: no wrench_setpoint")
        elif self.status.get("recorder", NodeStatus.DONE) in (NodeStatus.DONE, NodeStatus.FAULT) or self.ticks > 1000:
            self.over.set_result(None)
        if self.ticks % 25 == 0:
            self.publish_phase()

    def end(self, phase, reason=""):
        self.phase, self.reason, self.ticks = phase, reason, 0
        if not self.lockstep:
            self.clock.cancel()
        self.publish_phase()


def main():
    """Fly until the recorder has all; exit code 0 for a flight that ended, 1 for one that failed."""
    rclpy.init()
    vehicle = Vehicle()
    try:
        rclpy.spin_until_future_complete(vehicle, vehicle.over)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        return 1
    return 0 if vehicle.phase == FlightState.ENDED else 1


if __name__ == "__main__":
    raise SystemExit(main())

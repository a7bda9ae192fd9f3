"""One quadrotor in MuJoCo (RK4, 500 Hz) under this stack's laws in plain Python; prints what it took as JSON."""

import json
import sys
import time
from importlib.metadata import version

import mujoco

from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, PositionInputs, Quat, Vec3, VehicleState
from quad_flight.set_up import Request, resolve_flight

MODEL = """<mujoco><option timestep="0.002" gravity="0 0 -9.8" integrator="RK4"/><worldbody>
<body name="quad"><freejoint/><inertial pos="0 0 0" mass="{mass}" diaginertia="{xx} {yy} {zz}"/></body>
</worldbody></mujoco>"""


def main(steps: int) -> None:
    """Fly ``steps`` plant steps, position law at 100 Hz, attitude law at 500 Hz."""
    resolved = resolve_flight(Request("case2"), {})
    vehicle = resolved["simulator"].vehicle
    text = MODEL.format(mass=vehicle.mass, xx=vehicle.inertia_xx, yy=vehicle.inertia_yy, zz=vehicle.inertia_zz)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    path = resolved["trajectory"].plugins["trajectory"]
    position, attitude = (resolved[role].plugins["law"] for role in ("position_controller", "attitude_controller"))
    plan = path.module.plan(path.parameters, vehicle, VehicleState())
    memories = [law.module.init(law.parameters, vehicle) for law in (position, attitude)]
    nothing, setpoint = Actuation(), AttitudeThrust()
    wall, cpu = time.perf_counter(), time.process_time()
    for k in range(steps):
        p, v = data.qpos, data.qvel
        state = VehicleState(
            Vec3(*p[:3].tolist()),
            Vec3(*v[:3].tolist()),
            Quat(float(p[4]), float(p[5]), float(p[6]), float(p[3])),
            Vec3(*v[3:].tolist()),
        )
        if k % 5 == 0:
            reference = path.module.sample(path.parameters, plan, k * 0.002)
            inputs = PositionInputs(state, reference, nothing)
            setpoint, memories[0], _ = position.module.step(position.parameters, vehicle, memories[0], inputs, 0.01)
        asked = AttitudeInputs(state, setpoint, nothing)
        wrench, memories[1], _ = attitude.module.step(attitude.parameters, vehicle, memories[1], asked, 0.002)
        turn = data.xmat[1].reshape(3, 3)
        data.xfrc_applied[1, :3] = turn[:, 2] * wrench.thrust
        data.xfrc_applied[1, 3:] = turn @ wrench.torque_b
        mujoco.mj_step(model, data)
    took = {"steps": steps, "wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
    print(json.dumps({**took, "version": version("mujoco"), "height": float(data.qpos[2])}))


if __name__ == "__main__":
    main(int(sys.argv[1]))

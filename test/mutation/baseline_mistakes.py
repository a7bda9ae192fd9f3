"""Mistakes of the baseline laws, by function: (source, what stands there, what it becomes)."""

POSITION_BASELINES = {
    "quad_position_ctrl.ibs._axis": [
        ("IBS", "initial_gain=axis.velocity_gain", "initial_gain=axis.position_gain"),
        ("IBS", "max_gain=axis.velocity_gain", "max_gain=1.0"),
    ],
    "quad_position_ctrl.cascade.approach": [
        ("cascade", "-gain_xy * error.x", "gain_xy * error.x"),
        ("cascade", "-gain_z * error.z", "-gain_xy * error.z"),
        ("cascade", "level.limited or upright.limited", "level.limited"),
    ],
    "quad_position_ctrl.cascade.reach": [
        ("cascade", "limits.min_thrust * max_thrust(vehicle)", "0.0"),
        ("cascade", "bounded.thrust_limited or held.limited", "bounded.thrust_limited"),
    ],
    "quad_position_ctrl.pid.step": [
        ("PID", "- xy.velocity * error_v.y", "+ xy.velocity * error_v.y"),
        ("PID", "+ part.z", "- part.z"),
        ("PID", "- z.derivative * acceleration.z", "+ z.derivative * acceleration.z"),
        ("PID", "a_d.x - ", "-"),
        ("PID", "if not frozen", "if frozen"),
    ],
    "quad_position_ctrl.pid._acceleration": [
        ("PID", "1.0 - math.exp", "math.exp"),
        ("PID", "- before.y)", "+ before.y)"),
    ],
    "quad_position_ctrl.pid._integrated": [("PID", "part - gains", "part + gains")],
    "quad_position_ctrl.se3.step": [
        ("SE(3)", "xy.position / xy.velocity", "xy.position * xy.velocity"),
        ("SE(3)", "reference.a_w.z + ", ""),
        ("SE(3)", "wanted.velocity.y - error_v.y", "wanted.velocity.y + error_v.y"),
    ],
    "quad_position_ctrl.se3.desired_attitude": [
        ("SE(3)", "x3 * sin_yaw - y3 * cos_yaw", "x3 * sin_yaw + y3 * cos_yaw"),
        ("SE(3)", "-z3 * sin_yaw", "z3 * sin_yaw"),
        ("SE(3)", "-math.asin", "math.asin"),
        ("SE(3)", "x2 * y3 - y2 * x3", "x2 * y3 + y2 * x3"),
    ],
}

ATTITUDE_BASELINES = {
    "quad_attitude_ctrl.itsm.axis_control": [
        ("ITSM", "2.0 * axis.exponent", "axis.exponent"),
        ("ITSM", "error_rate + integral", "error_rate - integral"),
        ("ITSM", "acceleration - integrand", "acceleration + integrand"),
        ("ITSM", "-axis.switching_gain", "axis.switching_gain"),
    ],
    "quad_attitude_ctrl.itsm.signed_power": [("ITSM", "else -size", "else size")],
    "quad_attitude_ctrl.itsm.switching": [("ITSM", "sliding > 0.0", "sliding < 0.0")],
    "quad_attitude_ctrl.itsm._integrated": [("ITSM", "integral + dt", "integral - dt")],
    "quad_attitude_ctrl.pid.step": [
        ("PID", "goal.rates.x - roll.angle", "goal.rates.x + roll.angle"),
        ("PID", "- pitch.rate * error_rate.y", "+ pitch.rate * error_rate.y"),
        ("PID", "- yaw.derivative * measured.z", "+ yaw.derivative * measured.z"),
        ("PID", "share * fed.y", "fed.y"),
        ("PID", "vehicle.inertia_yy", "vehicle.inertia_xx"),
    ],
    "quad_attitude_ctrl.pid._integrated": [("PID", "part - gains", "part + gains")],
    "quad_attitude_ctrl.se3.step": [
        ("SE(3)", "omega_b.y - turned_rates.y", "omega_b.y + turned_rates.y"),
        ("SE(3)", "turned.z - carried.z", "turned.z + carried.z"),
        ("SE(3)", "gyroscopic.x / vehicle.inertia_xx", "0.0"),
        ("SE(3)", "-parameters.roll.angle * error.x", "parameters.roll.angle * error.x"),
    ],
    "quad_attitude_ctrl.se3.relative_attitude": [
        ("SE(3)", "- z * q.y", "+ z * q.y"),
        ("SE(3)", "w * q.w - x * q.x", "w * q.w + x * q.x"),
    ],
    "quad_attitude_ctrl.se3.rotation_error": [("SE(3)", "2.0 * relative.w * relative.z", "2.0 * relative.z")],
    "quad_attitude_ctrl.shaping.held": [("limits", "return -most", "return most")],
    "quad_attitude_ctrl.shaping.resting": [("limits", "limited.y or actuation.pitch_limited", "limited.y")],
}

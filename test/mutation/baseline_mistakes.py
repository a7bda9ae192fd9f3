"""Mistakes of the baseline laws, by function: (source, what stands there, what it becomes)."""

POSITION_BASELINES = {
    "quad_position_ctrl.ibs._adaptive_gains": [
        ("IBS", "initial_gain=gains.velocity_gain", "initial_gain=gains.position_gain"),
        ("IBS", "max_gain=gains.velocity_gain", "max_gain=1.0"),
    ],
    "quad_position_ctrl.pid.step": [
        ("PID", "- xy.velocity * velocity_error.y", "+ xy.velocity * velocity_error.y"),
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
        ("SE(3)", "correcting.y - velocity_error.y", "correcting.y + velocity_error.y"),
    ],
    "quad_position_ctrl.se3.desired_attitude": [
        ("SE(3)", "b3.x * sin_yaw - b3.y * cos_yaw", "b3.x * sin_yaw + b3.y * cos_yaw"),
        ("SE(3)", "-b3.z * sin_yaw", "b3.z * sin_yaw"),
        ("SE(3)", "-math.asin", "math.asin"),
        ("SE(3)", "cross(b2, b3)", "cross(b3, b2)"),
    ],
}

ATTITUDE_BASELINES = {
    "quad_attitude_ctrl.itsm.axis_control": [
        ("ITSM", "2.0 * gains.exponent", "gains.exponent"),
        ("ITSM", "error_rate + integral", "error_rate - integral"),
        ("ITSM", "acceleration - integrand", "acceleration + integrand"),
        ("ITSM", "-gains.switching_gain", "gains.switching_gain"),
    ],
    "quad_attitude_ctrl.itsm.signed_power": [("ITSM", "else -size", "else size")],
    "quad_attitude_ctrl.itsm.switching": [("ITSM", "sliding > 0.0", "sliding < 0.0")],
    "quad_attitude_ctrl.itsm._integrated": [("ITSM", "integral + dt", "integral - dt")],
    "quad_attitude_ctrl.pid.step": [
        ("PID", "goal.rates.x - roll.angle", "goal.rates.x + roll.angle"),
        ("PID", "- pitch.rate * rate_error.y", "+ pitch.rate * rate_error.y"),
        ("PID", "- yaw.derivative * measured.z", "+ yaw.derivative * measured.z"),
        ("PID", "scale(parameters.acceleration_feed_forward, desired_acceleration)", "desired_acceleration"),
        ("PID", "vehicle.inertia_yy", "vehicle.inertia_xx"),
    ],
    "quad_attitude_ctrl.pid._integrated": [("PID", "part - gains", "part + gains")],
    "quad_attitude_ctrl.se3.step": [
        ("SE(3)", "feed_forward.z + gyroscopic.z", "gyroscopic.z"),
        ("SE(3)", "gyroscopic.x / vehicle.inertia_xx", "0.0"),
    ],
    "quad_attitude_ctrl.indi.step": [
        ("INDI", "known.x + xx", "known.x - xx"),
        ("INDI", "feedback.y - measured.y", "feedback.y + measured.y"),
        ("INDI", "feed_forward.x + feedback.x", "feedback.x"),
        ("INDI", "inputs.actuation.torque_b", "ZERO"),
        ("INDI", "known.z + zz", "known.z + yy"),
    ],
    "quad_attitude_ctrl.indi.filtered": [
        ("INDI", "b.x + gain * (first.x - b.x)", "first.x"),
        ("INDI", "-bandwidth * dt", "-dt"),
    ],
    "quad_attitude_ctrl.geometric.tracking": [
        ("SE(3)", "subtract(state.omega_b, turned_rates)", "subtract(turned_rates, state.omega_b)"),
        ("SE(3)", "subtract(turned, cross(state.omega_b, turned_rates))", "turned"),
        ("SE(3)", "subtract(turned, cross", "subtract(Vec3(), cross"),
        ("SE(3)", "-roll.angle * error.x", "roll.angle * error.x"),
        ("SE(3)", "yaw.rate * error_rate.z", "yaw.rate * error.z"),
    ],
    "quad_attitude_ctrl.geometric.rotation_error": [("SE(3)", "2.0 * relative.w * relative.z", "2.0 * relative.z")],
}

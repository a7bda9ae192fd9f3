"""Mistakes of plants, rotors, weather, rotations, by function: (equation, what stands there, what it becomes)."""

PLANTS = {
    "quad_dynamics.newton_euler.thrust_force": [("2", "axis_w[1] * thrust", "axis_w[0] * thrust")],
    "quad_dynamics.newton_euler.drag_force": [
        ("5", "else -body.drag_coefficient", "else body.drag_coefficient"),
        ("5", "k * v_w[2]", "k * v_w[1]"),
    ],
    "quad_dynamics.newton_euler.drag_torque": [
        ("9", "-k * abs(p) * p", "-k * p * p"),
        ("9", "-k * abs(q) * q", "k * abs(q) * q"),
        ("9", "-k * abs(r) * r", "-k * abs(q) * r"),
        ("9", "k * r * r", "k * r"),
    ],
    "quad_dynamics.newton_euler.coupling_torque": [
        ("1", "(yy - zz)", "(zz - yy)"),
        ("1", "(zz - xx)", "(zz - yy)"),
        ("1", "(xx - yy)", "(yy - xx)"),
        ("1", "p * r", "p * q"),
    ],
    "quad_dynamics.newton_euler.linear_acceleration": [
        ("1", "- body.gravity", "+ body.gravity"),
        ("1", "lift[1] + drag[1]", "lift[1] - drag[1]"),
        ("1", "drag[0] + force_w[0]", "drag[0] - force_w[0]"),
        ("1", "force_w[2]) / mass", "force_w[2]) * mass"),
    ],
    "quad_dynamics.newton_euler.angular_acceleration": [
        ("1", "coupling[0] + torque_b[0]", "torque_b[0] - coupling[0]"),
        ("1", "/ body.inertia_yy", "/ body.inertia_xx"),
        ("1", "/ body.inertia_zz", "/ body.inertia_yy"),
        ("1", "torque_b[1] + drag[1]", "torque_b[1]"),
    ],
    "quad_dynamics.newton_euler.quaternion_rate": [
        ("13", "0.5 * omega_b[1]", "omega_b[1]"),
        ("13", "w * p + y * r - z * q", "w * p - y * r + z * q"),
        ("13", "w * q + z * p", "w * q - z * p"),
        ("13", "x * q - y * p", "x * q + y * p"),
        ("13", "-x * p", "x * p"),
    ],
    "quad_dynamics.rotors.rotor_thrust": [("3", "speed * speed", "speed")],
    "quad_dynamics.rotors.yaw_arm": [
        (
            "8",
            "vehicle.torque_coefficient / vehicle.lift_coefficient",
            "vehicle.lift_coefficient / vehicle.torque_coefficient",
        ),
    ],
    "quad_dynamics.rotors.wrench_from_rotors": [
        ("8", "thrusts.r4 - thrusts.r2\n", "thrusts.r2 - thrusts.r4\n"),
        ("8", "rear_over_front = thrusts.r1 - thrusts.r3", "rear_over_front = thrusts.r3 - thrusts.r1"),
        ("8", "thrusts.r1 - thrusts.r2 + thrusts.r3", "thrusts.r1 + thrusts.r2 - thrusts.r3"),
        ("8", "vehicle.arm_length * left_over_right", "left_over_right"),
        ("8", "left_over_right - rear_over_front", "left_over_right + rear_over_front"),
        ("3", "thrusts.r3 + thrusts.r4, ", "thrusts.r3 - thrusts.r4, "),
    ],
    "quad_dynamics.paper.thrust_axis": [
        ("15", "+ sphi * spsi", "- sphi * spsi"),
        ("15", "- sphi * cpsi", "+ sphi * cpsi"),
        ("15", "cphi * ctheta", "sphi * ctheta"),
    ],
    "quad_dynamics.paper.derivative": [
        ("16", "(x8, x10, x12)", "(x8, x12, x10)"),
        ("16", "(x2, x4, x6), acting.torque_b", "(x4, x2, x6), acting.torque_b"),
        ("16", "return (x2, dx2, x4", "return (x4, dx2, x4"),
    ],
    "quad_dynamics.paper.observe": [
        ("13", "body_rates(angles, Vec3(state.x2, state.x4, state.x6))", "Vec3(state.x2, state.x4, state.x6)"),
        ("16", "Vec3(state.x7, state.x9, state.x11)", "Vec3(state.x7, state.x11, state.x9)"),
    ],
    "quad_dynamics.rigid_body.derivative": [
        ("10", "add(rotors.torque_b, around.torque_b)", "rotors.torque_b"),
        (
            "1",
            "linear_acceleration(body, axis, thrust, v_w, force)",
            "linear_acceleration(body, axis, thrust, omega_b, force)",
        ),
        ("1", "(vx, vy, vz, a[0], a[1]", "(vx, vy, vz, a[1], a[0]"),
        ("13", "dx, dy, dz, dw, alpha[0]", "dx, dz, dy, dw, alpha[0]"),
    ],
    "quad_dynamics.newton_euler.rk4": [
        ("1", "moved(s, k1, 0.5 * h)", "moved(s, k1, h)"),
        ("16", "moved(s, k2, 0.5 * h)", "moved(s, k1, 0.5 * h)"),
        ("16", "moved(s, k3, h)", "moved(s, k3, 0.5 * h)"),
        ("beyond the paper", "rate(constant, end, ", "rate(constant, middle, "),
    ],
    "quad_dynamics.newton_euler.combined": [
        ("16", "h / 6.0", "h / 5.0"),
        ("16", "k1[3] + 2.0 * (k2[3] + k3[3])", "k1[3] + 2.0 * (k2[3] - k3[3])"),
        ("1", "2.0 * (k2[12] + k3[12])", "(k2[12] + k3[12])"),
    ],
    "quad_dynamics.rigid_body.with_unit_quaternion": [("4", "+ qw * qw", "- qw * qw")],
    "quad_dynamics.newton_euler.true_body": [
        ("10", "vehicle.mass + parameters.mass_error", "vehicle.mass - parameters.mass_error"),
        ("10", "vehicle.inertia_zz + error.zz", "vehicle.inertia_zz + error.yy"),
        ("10", "error.yy + added.y", "error.yy"),
    ],
    "quad_dynamics.uncertainty.nominal_acceleration": [
        ("11", "nominal_body(parameters, vehicle)", "nominal_body(parameters, vehicle._replace(mass=1.0))"),
        ("11", "clamp(wrench.torque_b.y", "clamp(wrench.torque_b.x"),
    ],
    "quad_dynamics.rotors.rotor_wrench": [
        ("10", "factor.pitch * made.torque_b.y", "factor.roll * made.torque_b.y"),
        ("10", "working.r3 * thrusts.r3", "working.r2 * thrusts.r3"),
        ("10", "factor.yaw * made.torque_b.z", "made.torque_b.z"),
        ("1", "yaw -= (angular", "yaw += (angular"),
        ("beyond the paper", "speeds.r3 + speeds.r4)", "speeds.r3 - speeds.r4)"),
    ],
    "quad_dynamics.rotors.angular_momentum": [("1", "speeds.r2 - speeds.r1", "speeds.r1 - speeds.r2")],
    "quad_dynamics.rotors.decay": [("beyond the paper", "math.exp(-", "(1.0 - ")],
    "quad_dynamics.rotors.rotor_lag": [
        ("beyond the paper", "speeds.r2 - commanded.r2", "speeds.r1 - commanded.r2"),
    ],
    "quad_dynamics.rotors.reached": [
        (
            "beyond the paper",
            "wrench_from_rotors(vehicle, thrusts)",
            "wrench_from_rotors(vehicle, allocated.rotor_thrust)",
        )
    ],
    "quad_dynamics.rotors.max_rotor_thrust": [("beyond the paper", "conditions.thrust_limit * ", "")],
    "quad_dynamics.newton_euler.wind_force": [("5", "k * wind_w[2]", "k * wind_w[1]")],
    "quad_dynamics.newton_euler.loaded": [
        ("beyond the paper", "mass * (x * x + z * z)", "mass * (y * y + z * z)"),
        ("beyond the paper", "mass * x * z - products.y", "mass * x * z + products.y"),
    ],
    "quad_dynamics.newton_euler.inertia_solved": [
        ("beyond the paper", "e * f - c * d", "e * f + c * d"),
        ("beyond the paper", "b * c - f * f", "b * c + f * f"),
    ],
    "quad_dynamics.newton_euler.loaded_accelerations": [
        ("beyond the paper", "damping[0] - lever.x", "damping[0] + lever.x"),
        ("beyond the paper", "d * p + b * q + f * r", "b * q + f * r"),
        ("beyond the paper", "add(cross(alpha, load.centre), ", "add(cross(load.centre, alpha), "),
        ("5", "lift[1] + drag[1]", "lift[1] - drag[1]"),
    ],
    "quad_dynamics.ground.foot_force": [
        ("beyond the paper", "q * foot.z - r * foot.y", "q * foot.z + r * foot.y"),
        ("beyond the paper", "stiffness * depth - damping", "stiffness * depth + damping"),
        ("beyond the paper", "-grip * vx", "grip * vx"),
    ],
    "quad_dynamics.ground.contact": [
        ("beyond the paper", "foot.z * force_b.x - foot.x * force_b.z", "foot.z * force_b.x + foot.x * force_b.z")
    ],
    "quad_dynamics.rigid_body.with_extensions": [
        ("1", "torque_b.x - omega_b[1] * rotors.spin", "torque_b.x + omega_b[1] * rotors.spin"),
        ("beyond the paper", "v_w[0] - wind.x", "v_w[0]"),
        ("beyond the paper", "v_w[1] - wind.y", "v_w[1] + wind.y"),
        ("beyond the paper", "v_w[2] - wind.z", "v_w[2]"),
        ("beyond the paper", "force.y - drag * (uy - along * axis_w.y)", "force.y - drag * uy"),
    ],
    "quad_dynamics.rigid_body.surroundings": [
        ("5", "add(conditions.force_w, Vec3(wind_x, wind_y, wind_z))", "conditions.force_w"),
    ],
    "quad_dynamics.rigid_body.lumped": [("11", "true[4] - ay", "true[4] + ay"), ("11", "true[12] - bz", "true[12]")],
    "quad_dynamics.paper.acting_on": [
        ("10", "add(rotors.torque_b, conditions.torque_b)", "rotors.torque_b"),
        ("5", "Vec3(wind_x, wind_y, wind_z)", "Vec3(wind_x, -wind_y, wind_z)"),
    ],
    "quad_dynamics.paper.lumped": [("11", "a[1] - ay", "a[1] + ay")],
    "quad_dynamics.sensor.sampled": [("beyond the paper", "q.x + q.w * x + q.y * z", "q.x + q.w * x - q.y * z")],
    "quad_dynamics.sensor.step": [
        ("beyond the paper", "row = 1 + k // parameters.period_steps", "row = k // parameters.period_steps"),
        ("beyond the paper", "k % parameters.period_steps == 0", "k % parameters.period_steps == 1"),
        ("beyond the paper", "put(line, k % SLOTS, last_sample)", "put(line, k % SLOTS, truth)"),
        ("beyond the paper", "reading = memory.reading", "reading = misread(memory.reading, fault)"),
        ("beyond the paper", ">= parameters.dropout", "< parameters.dropout"),
    ],
    "quad_dynamics.sensor.draw": [
        ("beyond the paper", "(steps - 1) // parameters.period_steps + 1", "(steps - 1) // parameters.period_steps"),
        ("beyond the paper", "(STREAM_FAMILY, channel)", "(STREAM_FAMILY, channel % 12)"),
    ],
    "quad_dynamics.sensor._steps": [
        ("beyond the paper", "seconds(1, plant_period) + 0.5", "seconds(1, plant_period)"),
        ("beyond the paper", "parameters.delay + getattr(parameters, name)", "getattr(parameters, name)"),
    ],
    "quad_dynamics.sensor.slot_of": [
        ("beyond the paper", "old = k - age", "old = k - age - 1"),
        ("beyond the paper", "old % SLOTS", "old % (SLOTS - 1)"),
    ],
    "quad_dynamics.sensor.aged": [
        ("beyond the paper", "slot_of(k, ages.velocity)", "slot_of(k, ages.position)"),
        (
            "beyond the paper",
            "slot_of(k, ages.attitude), slot_of(k, ages.rate)",
            "slot_of(k, ages.rate), slot_of(k, ages.attitude)",
        ),
    ],
    "quad_dynamics.sensor.renewed": [
        ("beyond the paper", "number % parameters.attitude_every", "number % parameters.rate_every"),
        ("beyond the paper", "rate = last.omega_b", "rate = sample.omega_b"),
    ],
    "quad_dynamics.sensor.errors": [
        ("beyond the paper", "bias * float(table[0, first + 1])", "bias * float(table[row, first + 1])"),
        ("beyond the paper", "noise * float(table[row, first + 2])", "noise * float(table[row, first])"),
    ],
    "quad_dynamics.sensor.misread": [("beyond the paper", "c * q.x - s * q.y", "c * q.x + s * q.y")],
    "quad_dynamics.link.step": [
        ("beyond the paper", "k + fault.delay / dt", "k - fault.delay / dt"),
        ("beyond the paper", "NEVER if fault.lost", "0.0 if fault.lost"),
        ("beyond the paper", "if memory.last == k - 1 else k - 1", "if memory.last == k - 2 else k - 1"),
    ],
    "quad_dynamics.rotors.pair_differences": [
        ("8", "return (roll / vehicle.arm_length, pitch", "return (pitch / vehicle.arm_length, pitch"),
        ("8", "scale * (pitch - roll)", "scale * (roll - pitch)"),
    ],
    "quad_dynamics.rotors.pair_sums": [
        ("8", "0.5 * (total - difference)", "0.5 * (total + difference)"),
        ("8", "larger(2.0 * width_13 - total", "smaller(2.0 * width_13 - total"),
        ("8", "larger(2.0 * width_13 - yaw_down", "smaller(2.0 * width_13 - yaw_down"),
        ("8", "smaller(top_13 - total", "larger(top_13 - total"),
    ],
    "quad_dynamics.rotors.nearest": [
        ("8", "0.5 * (s24 - d42)", "0.5 * (s24 + d42)"),
        ("8", "if widest > limit", "if widest < limit"),
    ],
    "quad_dynamics.rotors.allocate_within": [
        ("beyond the paper", "wrench.thrust - 4.0 * least", "wrench.thrust"),
        ("8", "0.5 * (s24 - d42)", "0.5 * (s24 + d42)"),
        ("8", "0.5 * (thrust - yaw_force)", "0.5 * (thrust + yaw_force)"),
        ("8", "abs(achieved.torque_b.x - torque.x)", "(achieved.torque_b.x - torque.x)"),
        ("3", "achieved.thrust < wrench.thrust", "achieved.thrust > wrench.thrust"),
    ],
    "quad_dynamics.held_gaussian.draw": [
        ("sect. 4", "-clip[channel]", "-sd[channel]"),
        ("sect. 4", "(STREAM_FAMILY, channel)", "(STREAM_FAMILY, 0)"),
        ("sect. 4", "vehicle.inertia_xx, vehicle.inertia_yy", "vehicle.inertia_yy, vehicle.inertia_xx"),
    ],
    "quad_dynamics.timeline.sample": [
        ("beyond the paper", "- float(table[row, 1]) + EDGE", "- float(table[row, 1])"),
        ("beyond the paper", "time + EDGE < float", "time - EDGE < float"),
    ],
    "quad_dynamics.timeline.drawn_row": [("sect. 4", "since / period", "since / period + 1.0")],
    "quad_dynamics.timeline.air": [
        ("beyond the paper", "now.x + part * (then.x - now.x)", "now.x"),
        ("beyond the paper", "s * u + c * v", "s * u - c * v"),
        ("beyond the paper", "2.0 * math.pi * since / length", "math.pi * since / length"),
    ],
    "quad_dynamics.timeline.late": [
        ("beyond the paper", "float(table[drawn, 1])", "float(table[drawn, 0])"),
    ],
    "quad_dynamics.timeline.misread": [
        ("beyond the paper", "c.sensor.frozen or frozen", "frozen"),
    ],
    "quad_dynamics.held_gaussian.sample": [
        ("sect. 4", "time / parameters.hold + EDGE_TOLERANCE", "time / parameters.hold + 0.5"),
        ("sect. 4", "float(table[index, 4])", "float(table[index, 3])"),
    ],
}

ROTATIONS = {
    "quad_core.geometry.quaternion_from_euler": [
        ("4", "sr * cp * cy - cr * sp * sy", "sr * cp * cy + cr * sp * sy"),
        ("4", "cr * cp * sy - sr * sp * cy", "cr * cp * sy + sr * sp * cy"),
    ],
    "quad_core.geometry.body_z": [
        ("4", "q.x * q.z + q.w * q.y", "q.x * q.z - q.w * q.y"),
        ("4", "q.y * q.z - q.w * q.x", "q.y * q.z + q.w * q.x"),
    ],
    "quad_core.geometry.relative_attitude": [
        ("SE(3)", "- z * q.y", "+ z * q.y"),
        ("SE(3)", "w * q.w - x * q.x", "w * q.w + x * q.x"),
    ],
    "quad_core.geometry.turned": [
        ("13", "0.5 * turn.z", "turn.z"),
        ("13", "q.w * x + q.x * cosine + q.y * z", "q.w * x + q.x * cosine - q.y * z"),
    ],
    "quad_core.geometry.rotate": [("4", "q.w * ty + q.z * tx", "q.w * ty - q.z * tx")],
    "quad_core.geometry.euler_from_quaternion": [
        ("4", "q.w * q.y - q.z * q.x", "q.w * q.y + q.z * q.x"),
        ("4", "Vec3(phi, math.asin(sine), psi)", "Vec3(psi, math.asin(sine), phi)"),
    ],
    "quad_core.geometry.euler_rates": [
        ("13", "sphi * omega_b.y + cphi * omega_b.z", "sphi * omega_b.y - cphi * omega_b.z"),
        ("13", "omega_b.x + turn", "omega_b.x - turn"),
        ("13", "cphi * omega_b.y - sphi", "cphi * omega_b.y + sphi"),
        ("13", "* math.sin(angles.y) / ctheta", "* math.sin(angles.y)"),
    ],
    "quad_core.geometry.body_rates": [
        ("13", "rates.x - math.sin(angles.y)", "rates.x + math.sin(angles.y)"),
        ("13", "+ sphi * ctheta * rates.z", "+ sphi * rates.z"),
    ],
    "quad_core.geometry.wrap_angle": [("40", "math.floor", "math.ceil"), ("40", "angle + 2.0", "angle - 2.0")],
}

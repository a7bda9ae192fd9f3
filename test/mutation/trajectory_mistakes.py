"""Mistakes of the trajectories, by function: (equation, what stands there, what it becomes)."""

TRAJECTORIES = {
    "quad_trajectory.case1.curve": [
        ("61", "math.pi / 3.0, 0.0", "0.0, math.pi / 3.0"),
        ("61", "math.pi / 3.0", "math.pi / 2.0"),
        ("61", "t - 40.0", "t - 20.0"),
        ("61", "t - 40.0 * parameters.time_scale", "t - 40.0"),
        ("61", "speed = length / parameters.time_scale", "speed = length"),
        ("62", "speed * x.v", "speed * y.v"),
        ("63", "length * y.p", "length * x.p"),
        ("64", "length * 11.0", "length * 10.0"),
    ],
    "quad_trajectory.case1.square": [
        ("62", "AxisPoint(5.0 + 0.5 * t, 0.5", "AxisPoint(5.0 - 0.5 * t, 0.5"),
        ("62", "15.0 - 0.5 * (t - 40.0)", "15.0 + 0.5 * (t - 40.0)"),
        ("62", "t < 40.0", "t < 30.0"),
        ("63", "5.0 + 0.5 * (t - 20.0)", "5.0 + 0.5 * t"),
        ("63", "AxisPoint(15.0 - 0.5 * (t - 60.0), -0.5", "AxisPoint(15.0 - 0.5 * (t - 60.0), 0.5"),
    ],
    "quad_trajectory.case2.curve": [
        ("65", "math.pi / 3.0, 0.0", "0.0, math.pi / 3.0"),
        ("66", "radius * math.cos(rate * t)", "radius * math.sin(rate * t)"),
        ("66", "-rate * sine", "rate * sine"),
        ("66", "-rate2 * cosine", "rate2 * cosine"),
        ("66", "rate = 0.5", "rate = 0.4"),
        ("67", "rate * cosine, -rate2 * sine", "rate * cosine, rate2 * sine"),
        ("67", "-rate * rate2 * cosine", "rate * rate2 * cosine"),
        ("65", "t - 40.0 * parameters.time_scale", "t - 40.0"),
        ("68", "radius + climb * t", "radius - climb * t"),
        ("68", "climb = 0.5", "climb = 0.05"),
    ],
    "quad_trajectory.approach.sample_approach": [
        ("schedule", "time - approach.duration", "time"),
        ("schedule", "since_gate - approach.run_up.duration", "since_gate"),
    ],
    "quad_trajectory.lemniscate.curve": [
        ("lemniscate", "SQRT_2 * width", "width"),
        ("lemniscate", "velocity * cosine2", "2.0 * velocity * cosine2"),
        ("lemniscate", "-2.0 * acceleration", "2.0 * acceleration"),
        ("lemniscate", "-4.0 * jerk", "-2.0 * jerk"),
        ("lemniscate", "8.0 * snap", "4.0 * snap"),
        ("lemniscate", "0.5 * width * sine2", "0.5 * width * sine"),
    ],
    "quad_trajectory.lemniscate.in_plane": [
        ("lemniscate", "math.sin(parameters.inclination)", "math.cos(parameters.inclination)"),
        ("lemniscate", "along * cosine - horizontal * sine", "along * cosine + horizontal * sine"),
    ],
    "quad_trajectory.run_up.plan_run_up": [
        ("approach", "if one.found", "if True"),
    ],
    "quad_trajectory.limits.is_within": [
        ("approach", "range(SAMPLES + 1)", "range(SAMPLES // 4)"),
        ("approach", "speed * speed", "2.0 * speed * speed"),
        ("approach", "allowed.gravity + z.a", "allowed.gravity"),
    ],
    "quad_trajectory.limits.allowed_between": [
        ("approach", "END_MARGIN * norm(first.jerk_w)", "8.0 * norm(first.jerk_w)"),
        ("approach", "larger(norm(start.v_w), norm(first.v_w))", "norm(first.v_w)"),
    ],
    "quad_trajectory.polynomial.settling": [
        ("approach", "end.a / 2.0", "end.a / 3.0"),
        ("approach", "jerk / 20.0", "jerk / 10.0"),
    ],
    "quad_trajectory.minimum_snap.add_segment": [
        ("minimum snap", "RISE[row]", "abs(RISE[row])"),
        ("minimum snap", "powers[column % 3]", "powers[row % 3]"),
    ],
    "quad_trajectory.minimum_snap.write_coefficients": [
        ("minimum snap", "6.5 * a1", "6.0 * a1"),
        ("minimum snap", "j0 / 1.5 - 15.0 * v1", "j0 / 2.5 - 15.0 * v1"),
    ],
    "quad_trajectory.time_allocation.sample_factor": [
        ("time allocation", "math.sqrt(spare) - g * z.a", "math.sqrt(spare) + g * z.a"),
        ("time allocation", "g - limits.min_thrust", "g"),
        ("time allocation", "limits.tilt_tangent * z.a", "0.0 * z.a"),
    ],
    "quad_trajectory.time_allocation.segment_factor": [
        ("time allocation", "factor = turn / float(path[segment, 1])", "factor = 0.0"),
        ("time allocation", "range(samples + 1)", "range(2)"),
    ],
    "quad_trajectory.waypoint_text.number": [
        ("waypoints", "10 * digits", "8 * digits"),
        ("waypoints", "if fraction else scale", "if digits else scale"),
    ],
}

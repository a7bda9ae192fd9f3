"""Mistakes of the trajectories, by function: (equation, what stands there, what it becomes)."""

TRAJECTORIES = {
    "quad_trajectory.case1.curve": [
        ("61", "math.pi / 3.0, 0.0", "0.0, math.pi / 3.0"),
        ("61", "math.pi / 3.0", "math.pi / 2.0"),
        ("61", "t - 40.0", "t - 20.0"),
        ("62", "speed * x.v", "speed * y.v"),
        ("63", "length * y.p", "length * x.p"),
        ("64", "length * 11.0", "length * 10.0"),
    ],
    "quad_trajectory.case1.square": [
        ("62", "Motion(5.0 + 0.5 * t, 0.5", "Motion(5.0 - 0.5 * t, 0.5"),
        ("62", "15.0 - 0.5 * (t - 40.0)", "15.0 + 0.5 * (t - 40.0)"),
        ("62", "t < 40.0", "t < 30.0"),
        ("63", "5.0 + 0.5 * (t - 20.0)", "5.0 + 0.5 * t"),
        ("63", "Motion(15.0 - 0.5 * (t - 60.0), -0.5", "Motion(15.0 - 0.5 * (t - 60.0), 0.5"),
    ],
    "quad_trajectory.case2.curve": [
        ("65", "math.pi / 3.0, 0.0", "0.0, math.pi / 3.0"),
        ("66", "radius * math.cos(rate * t)", "radius * math.sin(rate * t)"),
        ("66", "-rate * sine", "rate * sine"),
        ("66", "-rate2 * cosine", "rate2 * cosine"),
        ("66", "rate = 0.5", "rate = 0.4"),
        ("67", "rate * cosine, -rate2 * sine", "rate * cosine, rate2 * sine"),
        ("67", "-rate * rate2 * cosine", "rate * rate2 * cosine"),
        ("68", "radius + climb * t", "radius - climb * t"),
        ("68", "climb = 0.5", "climb = 0.05"),
    ],
}

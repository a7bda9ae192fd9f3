"""Mistakes that sensors, motors and clock of a plant under an autopilot invite; form as in ``bridge_mistakes``."""

HIL = {
    "quad_mavlink.hil.earth.pressure": [("air", "LAPSE * altitude", "altitude"), ("air", "EXPONENT", "1.0")],
    "quad_mavlink.hil.earth.pressure_altitude": [("air", "1.0 / EXPONENT", "EXPONENT")],
    "quad_mavlink.hil.earth.temperature": [("air", " - KELVIN", "")],
    "quad_mavlink.hil.earth.place": [
        ("place", "p_w.y / (meridian", "p_w.x / (meridian"),
        ("place", " * math.cos(latitude)", ""),
        ("place", "w ** 3", "w"),
        ("place", "home.altitude + p_w.z", "home.altitude - p_w.z"),
    ],
    "quad_mavlink.hil.earth.magnetic_field": [
        ("field", "-home.field_strength * math.sin(inclination)", "home.field_strength * math.sin(inclination)"),
        ("field", "along * math.sin(declination), along * math.cos(declination)",
         "along * math.cos(declination), along * math.sin(declination)"),
    ],
    "quad_mavlink.hil.sensors.wander": [
        ("bias", "math.exp(-dt / time)", "1.0"),
        ("bias", "0.5 * time", "time"),
        ("bias", "kept * kept", "kept"),
    ],
    "quad_mavlink.hil.sensors.white": [("noise", "density / math.sqrt(dt)", "density * math.sqrt(dt)")],
    "quad_mavlink.hil.sensors.init": [("bias", "parameters.accelerometer.turn_on", "parameters.gyro.turn_on")],
    "quad_mavlink.hil.sensors.inertial": [
        ("gravity", "Vec3(0.0, 0.0, gravity)", "Vec3(0.0, 0.0, -gravity)"),
        ("gravity", "Vec3(0.0, 0.0, gravity)", "Vec3(0.0, 0.0, 0.0)"),
        ("frames", "Inertial(frames.body(rate), frames.body(force))", "Inertial(frames.body(rate), force)"),
        ("frames", "Inertial(frames.body(rate), frames.body(force))", "Inertial(rate, frames.body(force))"),
        ("frames", "rotate_inverse(middle(before.q_wb, now.q_wb)", "rotate_inverse(before.q_wb"),
        ("bias", "gyro=gyro_bias", "gyro=memory.gyro"),
        ("bias", "accelerometer=force_bias", "accelerometer=memory.accelerometer"),
        ("noise", "normals(row, ACCEL)", "normals(row, GYRO)"),
    ],
    "quad_mavlink.hil.sensors.middle": [("frames", "p + sign * q", "p + q")],
    "quad_mavlink.hil.sensors.compass": [
        ("frames", "frames.body(add(field, add(bias, noise)))", "add(field, add(bias, noise))"),
        ("frames", "rotate_inverse(q_wb, earth.magnetic_field(parameters.home))",
         "earth.magnetic_field(parameters.home)"),
    ],
    "quad_mavlink.hil.sensors.air": [
        ("air", "home.altitude + height", "height"),
        ("noise", "parameters.noise * float(row[BARO])", "0.0"),
        ("drift", "parameters.drift * time", "parameters.drift"),
    ],
    "quad_mavlink.hil.sensors.fix": [
        ("frames", "frames.world(velocity)", "velocity"),
        ("noise", "upright.z", "level.z"),
        ("noise", "add(late.p_w, error)", "late.p_w"),
    ],
    "quad_mavlink.hil.motors.airframe": [
        ("order", "rotor0=RotorPlace(side, side, ratio)", "rotor0=RotorPlace(side, -side, ratio)"),
        ("yaw sign", "RotorPlace(side, -side, -ratio)", "RotorPlace(side, -side, ratio)"),
        ("scale", "0.25 * max_thrust(vehicle)", "max_thrust(vehicle)"),
    ],
    "quad_mavlink.hil.motors.refusal": [
        ("nan", "not -_SLACK <= control <= 1.0 + _SLACK", "control < -_SLACK or control > 1.0 + _SLACK"),
        ("lockstep", "not answer.flags & LOCKSTEP", "False"),
        ("timestamps", "answer.time_usec > sent_usec", "False"),
    ],
    "quad_mavlink.hil.motors.wrench": [
        ("armed", "not answer.armed", "False"),
        ("frames", "frames.body(Vec3(x, y, z))", "Vec3(x, y, z)"),
        ("curve", "curve * u * u", "curve * u"),
    ],
    "quad_mavlink.hil.messages.sensor": [
        ("units", "0.01 * still.pressure", "still.pressure"),
        ("marks", "MAGNETIC if field is not None else 0", "MAGNETIC"),
        ("order", "*inertial.force, *inertial.rate", "*inertial.rate, *inertial.force"),
    ],
    "quad_mavlink.hil.messages.gps": [
        ("frames", "north, east, down = fix.velocity", "east, north, down = fix.velocity"),
        ("units", "_short(100.0 * down)", "_short(down)"),
        ("course", "math.atan2(east, north)", "math.atan2(north, east)"),
    ],
    "quad_mavlink.hil.messages.truth": [
        ("wxyz", "(w, x, y, z), *frames", "(x, y, z, w), *frames"),
        ("frames", "*frames.body(state.omega_b)", "*state.omega_b"),
        ("units", "1000.0 * each / _GRAVITY", "1000.0 * each"),
    ],
    "quad_mavlink.hil.suite.Suite.read": [
        ("clock", "self._count * self._period // _MICROSECOND", "(self._count - 1) * self._period // _MICROSECOND"),
        ("delay", "self._past[0]", "self._past[-1]"),
        ("rates", "dt * parameters.gps.period_steps", "dt"),
        ("noise", "self._count % sensors.BLOCK == 0", "False"),
    ],
    "quad_mavlink.hil.exchange.Exchange.answer": [
        ("lockstep", "found.time_usec == self.suite.time_usec", "True"),
        ("nan", "refused := motors.refusal(found, self.suite.time_usec)", "refused := ''"),
    ],
    "quad_mavlink.hil.exchange.Exchange.boot": [("clock", "self._due + period", "self._due")],
    "quad_mavlink.hil.gate.Gate.is_of_our_clock": [("clock", "0 <= 1e-06 * (now - stamp)", "1e-06 * (now - stamp)")],
    "quad_mavlink.hil.gate.Gate.on_state": [
        ("lag", "now - stamp", "0"),
        ("spacing", "stamp - self._stamp", "now - self._stamp"),
        ("clock", "not self.is_of_our_clock(stamp, now)", "False"),
    ],
    "quad_mavlink.hil.gate.Gate.on_published": [
        ("period", "step >= due", "True"),
        ("period", "step + self._periods[topic]", "step"),
    ],
    "quad_mavlink.hil.gate.Gate.on_answer": [
        ("older state", "step >= self._open.get(topic, step + 1)", "topic in self._open"),
    ],
    "quad_mavlink.hil.gate.Gate.decide": [
        ("lockstep", "is_flying and self._open", "False"),
        ("ground", "is_flying and self._open", "self._open"),
        ("timeout", "idle > self._parameters.answer_timeout", "False"),
        ("lag", "min(self._lags)", "max(self._lags)"),
        ("spacing", "ahead <= min(spacings)", "ahead <= max(spacings)"),
        ("spacing", "ahead <= max(spacings) or", "ahead <= min(spacings) or"),
        ("ground", "not is_flying or self._given_up == self._stamp", "self._given_up == self._stamp"),
        ("overdue", "self._given_up == self._stamp", "self._given_up >= 0"),
        ("overdue", "idle < self._parameters.overdue", "True"),
        ("linger", "idle >= self._parameters.linger", "True"),
    ],
}  # fmt: skip

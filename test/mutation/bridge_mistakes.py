"""Mistakes that a bridge to an autopilot invites, by function: (what it is about, what stands there, its mistake)."""

AUTOPILOT = {
    "quad_autopilot.frames.world": [
        ("frames", "Vec3(v.y, v.x, -v.z)", "Vec3(v.x, v.y, -v.z)"),
        ("sign", "-v.z", "v.z"),
    ],
    "quad_autopilot.frames.body": [
        ("sign", "Vec3(v.x, -v.y, -v.z)", "Vec3(v.x, v.y, -v.z)"),
        ("frames", "Vec3(v.x, -v.y, -v.z)", "Vec3(v.x, -v.z, -v.y)"),
        ("yaw sign", "Vec3(v.x, -v.y, -v.z)", "Vec3(v.x, -v.y, v.z)"),
    ],
    "quad_autopilot.frames.attitude": [
        ("frames", "_S * (q.y - q.x)", "_S * (q.x - q.y)"),
        ("wxyz", "Quat(x, y, z, w)", "Quat(w, x, y, z)"),
    ],
    "quad_autopilot.odometry.refusal": [
        ("frames", "sample.velocity_frame != NED", "sample.pose_frame != NED"),
        ("nan", "*sample.position, *sample.q", "*sample.q"),
        ("timestamps", "sample.timestamp_sample <= newest", "sample.timestamp <= newest"),
        ("reorder", "sample.timestamp_sample <= newest", "sample.timestamp_sample < newest"),
    ],
    "quad_autopilot.odometry.state": [
        ("wxyz", "w, x, y, z = sample.q", "x, y, z, w = sample.q"),
        ("frames", "frames.world(Vec3(*sample.velocity))", "frames.body(Vec3(*sample.velocity))"),
        ("frames", "frames.body(Vec3(*sample.angular_velocity))", "Vec3(*sample.angular_velocity)"),
    ],
    "quad_autopilot.odometry.jump": [
        ("reset", "p + elapsed * v", "p"),
        ("reset", "math.hypot(turn.x, turn.y)", "turn.z"),
    ],
    "quad_autopilot.spacing.misfit": [
        ("spacing", "taken > 2 * announced", "taken > 4 * announced"),
        ("spacing", "shortest < plant_period", "longest < plant_period"),
    ],
    "quad_autopilot.thrust.compensated": [("curve", "believed * u * u", "true * u * u")],
    "quad_autopilot.thrust.rates": [
        ("sign", "math.copysign(2.0 * gain, error.w)", "2.0 * gain"),
        ("rates", "clamp(turn.z, -limit, limit)", "turn.z"),
    ],
    "quad_autopilot.thrust.hover_report": [("scale", "weight / mean", "mean / weight")],
    "quad_autopilot.arming._streaming": [
        ("arming", "memory.beats < parameters.beats", "memory.beats < 1"),
        ("arming", "inputs.autopilot.armed", "False"),
        ("arming", "refusal = inputs.refusal", "refusal = ''"),
    ],
    "quad_autopilot.arming._preparing": [
        ("takeover", "phase != Phase.MODE and _is_left(memory, autopilot)", "False"),
        ("modes", "phase == Phase.MODE and autopilot.control == Control.OURS", "phase == Phase.MODE"),
        ("arming", "phase == Phase.ARM and armed", "phase == Phase.ARM"),
        ("arming", ">= parameters.spool_up", ">= 0.0"),
        ("timestamps", "inputs.autopilot_time - memory.spooled_from", "inputs.now - memory.since"),
    ],
    "quad_autopilot.arming._flying": [
        ("takeover", "if _is_left(memory, autopilot)", "if False"),
        ("takeover", "_is_left(memory, autopilot)", "autopilot.control == Control.OTHER"),
        ("arming", "not autopilot.armed", "False"),
        ("heartbeat", "inputs.command_age > _patience(parameters, memory, inputs)", "False"),
        ("state", "inputs.state_age > parameters.state_timeout", "False"),
    ],
    "quad_autopilot.arming._landing": [
        ("takeover", "autopilot.control not in (Control.OURS, Control.LANDING, Control.UNSAID)", "False"),
    ],
    "quad_autopilot.arming._is_left": [("takeover", " or not math.isinf(memory.left_at)", "")],
    "quad_autopilot.arming._leave": [
        ("takeover", "min(memory.left_at, inputs.now)", "inputs.now"),
        ("takeover", "_release(memory, taken(profile, autopilot, when, memory.usual))", "_land(profile, memory, when)"),
    ],
    "quad_autopilot.arming._request": [
        ("arming", "inputs.now - memory.asked_at < parameters.answer_timeout", "False"),
        ("takeover", "not math.isinf(memory.left_at)", "False"),
        ("takeover", "(Control.LANDING, Control.UNSAID)", "(Control.LANDING,)"),
    ],
    "quad_autopilot.arming._stream": [
        ("takeover", "if not math.isinf(memory.left_at)", "if False"),
        ("takeover", " or not offboard", ""),
        ("heartbeat", "memory.failed or not fresh", "not fresh"),
        ("heartbeat", "fresh = inputs.command_age <= parameters.command_timeout", "fresh = True"),
        ("arming", "memory.phase <= Phase.SPOOL_UP", "memory.phase <= Phase.ARM"),
    ],
}

PX4 = {
    "quad_px4.mapping._scales": [
        ("scale s", "/ 2.0)", ")"),
        ("scale", "np.max(mix[:, 2])", "np.mean(np.abs(mix[:, 2]))"),
    ],
    "quad_px4.mapping.build": [
        ("yaw sign", "math.copysign(airframe.drag_ratio or abs(rotor.km), rotor.km)", "rotor.km"),
        ("frames", "[-rotor.py, rotor.px, ratio, 1.0]", "[rotor.py, rotor.px, ratio, 1.0]"),
    ],
    "quad_px4.mapping.rotor_commands": [("sign", "frames.body(wrench.torque_b)", "wrench.torque_b")],
    "quad_px4.mapping._shares": [("newtons", "forces[0] / largest", "forces[0]")],
    "quad_px4.mapping.allocated": [
        ("saturation", "part * t < -lift * u", "False"),
        ("saturation", "part * spread > its_unit", "False"),
        ("saturation", "part * abs(turn) > room", "False"),
        ("saturation", "share if turn < 0.0 else 1.0 - share", "share"),
        ("saturation", "min(lift, *((1.0 - t) / u for t, u in zip(tilt, unit, strict=True)))", "lift"),
        ("yaw sign", "(0.0, 0.0, torque.z, 0.0)", "(0.0, 0.0, -torque.z, 0.0)"),
        ("clip", "max(wrench.thrust, 0.0)", "wrench.thrust"),
    ],
    "quad_px4.mapping.thrust_torque": [
        ("frames", "_unit(gain * y), _unit(gain * z)", "_unit(gain * z), _unit(gain * y)"),
        ("yaw sign", "_unit(gain * z)", "_unit(-gain * z)"),
        ("sign", "-compensated(", "compensated("),
    ],
    "quad_px4.mapping.motors": [
        ("nan", "[math.nan]", "[0.0]"),
        ("clip", "allocated(mapping, wrench)", "rotor_commands(mapping, wrench)"),
    ],
    "quad_px4.mapping.collective": [
        ("newtons", "newtons / (4.0 * mapping.airframe.max_rotor_thrust)", "newtons"),
        ("scale", "4.0 * mapping", "mapping"),
        ("curve", "compensated(mapping.airframe, fraction)", "fraction"),
        ("sign", "-compensated(", "compensated("),
    ],
    "quad_px4.mapping.attitude": [("frames", "frames.attitude(setpoint.q_wb)", "setpoint.q_wb")],
    "quad_px4.mapping.rates": [("frames", "frames.body(thrust.rates(", "(thrust.rates(")],
    "quad_px4.mapping.predict": [("sign", "frames.body(Vec3(x, y, z))", "Vec3(x, y, z)")],
    "quad_px4.autopilot.autopilot": [
        ("takeover", "mode.timestamp > status.timestamp", "mode.timestamp < status.timestamp"),
        ("takeover", "mode is not None", "mode is None"),
        ("takeover", "if mode.offboard", "if True"),
        ("arming", "armed = mode.armed", "armed = True"),
        ("modes", "whose == Control.OURS", "whose == Control.OTHER"),
    ],
    "quad_px4.autopilot.control": [
        ("modes", "Control.LANDING if nav_state in LANDING else known", "known"),
    ],
    "quad_px4.messages.sample": [
        ("timestamps", "int(message.timestamp_sample)", "int(message.timestamp)"),
        ("frames", "int(message.velocity_frame)", "int(message.pose_frame)"),
    ],
    "quad_px4.messages.heartbeat": [
        ("modes", "LEVELS[mode], True", "LEVELS[mode], False"),
        ("timestamps", "timestamp=timestamp", "timestamp=0"),
    ],
    "quad_px4.messages.command": [
        ("target", "target_system = message.source_system = target", "target_system = message.source_system = 1"),
        ("timestamps", "timestamp=timestamp", "timestamp=0"),
        ("arming", "from_external = True", "from_external = False"),
    ],
    "quad_px4.messages.thrust_torque": [
        ("frames", "list(value.thrust), list(value.torque)", "list(value.torque), list(value.thrust)"),
        ("timestamps", "VehicleTorqueSetpoint(timestamp=timestamp", "VehicleTorqueSetpoint(timestamp=sampled"),
    ],
    "quad_px4.messages.motors": [("timestamps", "timestamp_sample=sampled", "timestamp_sample=timestamp")],
    "quad_px4.messages.attitude": [
        ("wxyz", "[value.q.w, value.q.x, value.q.y, value.q.z]", "[value.q.x, value.q.y, value.q.z, value.q.w]"),
        ("nan", "yaw_sp_move_rate=math.nan", "yaw_sp_move_rate=0.0"),
    ],
    "quad_px4.messages.rates": [("frames", "message.roll, message.pitch", "message.pitch, message.roll")],
    "quad_px4.messages.topic": [("topic", "if version(message_type)", "if False")],
}

MAVLINK = {
    "quad_mavlink.setpoints.fraction": [
        ("newtons", "newtons / (4.0 * settings.max_rotor_thrust)", "newtons"),
        ("curve", "thrust.compensated(settings.autopilot_curve, settings.thrust_curve, share)", "share"),
    ],
    "quad_mavlink.setpoints.target": [
        ("type_mask", "AttitudeTarget(ATTITUDE_ONLY", "AttitudeTarget(RATES_ONLY"),
        ("type_mask", "AttitudeTarget(RATES_ONLY", "AttitudeTarget(ATTITUDE_ONLY"),
        ("frames", "frames.body(thrust.rates(", "(thrust.rates("),
        ("tilt", " if boosts else 1.0", ""),
    ],
    "quad_mavlink.setpoints._wxyz": [
        ("wxyz", "return (w, x, y, z)", "return (x, y, z, w)"),
        ("frames", "frames.attitude(q)", "q"),
    ],
    "quad_mavlink.estimate.of_odometry": [
        ("frames", "child == BODY_FRD", "child == LOCAL_NED"),
        ("frames", "NED if each == LOCAL_NED else _OTHER", "NED"),
    ],
    "quad_mavlink.estimate.of_pair": [
        ("timestamps", "1000 * time_boot_ms", "time_boot_ms"),
        ("timestamps", "> LATEST", "< -LATEST"),
        ("timestamps", "p + elapsed * v", "p - elapsed * v"),
    ],
    "quad_mavlink.modes.said": [
        ("arming", "heartbeat.base_mode & _ARMED", "heartbeat.base_mode"),
        ("modes", "heartbeat.autopilot == PX4", "heartbeat.autopilot != PX4"),
    ],
    "quad_mavlink.modes._px4": [
        ("modes", "custom_mode >> 16 & 255", "custom_mode & 255"),
        ("modes", "Control.OURS if main == _OFFBOARD else Control.OTHER", "Control.OURS"),
    ],
    "quad_mavlink.modes._copter": [("modes", "_LAND: Control.LANDING", "_LAND: Control.OURS")],
    "quad_mavlink.vehicle.MavlinkVehicle.fly": [
        ("timestamps", "stamps.sampled // 1000", "stamps.sampled"),
        ("timestamps", "stamps.sampled // 1000", "stamps.now // 1000"),
        ("target", "self.settings.target_system", "1"),
    ],
    "quad_mavlink.vehicle.MavlinkVehicle.stamped": [("timestamps", "0.001 * (", "(")],
    "quad_mavlink.vehicle.MavlinkVehicle._on_timesync": [
        ("timestamps", "0.5 * taken", "taken"),
        ("timestamps", "message.tc1 == 0", "False"),
    ],
    "quad_mavlink.vehicle.MavlinkVehicle.every_second": [
        ("heartbeat", "_ONBOARD_CONTROLLER, _NO_AUTOPILOT", "_NO_AUTOPILOT, _ONBOARD_CONTROLLER"),
    ],
    "quad_mavlink.vehicle.MavlinkVehicle.refusal": [
        ("arming", "self.kind == modes.ARDUPILOT and (not", "self.kind == modes.PX4 and (not"),
        ("arming", "& THRUST_AS_THRUST", "& 1"),
    ],
    "quad_mavlink.vehicle.MavlinkVehicle._command": [
        ("target", "self.settings.target_system", "1"),
        ("nan", "0.0 if math.isnan(value) else float(value)", "float(value)"),
    ],
    "quad_mavlink.vehicle.MavlinkVehicle._on_ack": [("target", "return", "pass")],
}

CRAZYFLIE = {
    "quad_crazyflie.setpoints.manual": [
        ("sign", "math.asin(clamp(-left, -1.0, 1.0))", "math.asin(clamp(left, -1.0, 1.0))"),
        ("frames", "math.cos(yaw) * z.x + math.sin(yaw) * z.y", "z.x"),
        ("yaw sign", "wrap_angle(desired - yaw)", "wrap_angle(yaw - desired)"),
        ("degrees", "math.degrees(pitch)", "pitch"),
        ("scale", "raw - LEAST", "raw"),
        ("newtons", "setpoint.thrust / (4.0 * settings.max_rotor_thrust)", "setpoint.thrust"),
        ("clip", "clamp(math.atan2(forward, z.z), -limit, limit)", "math.atan2(forward, z.z)"),
    ],
    "quad_crazyflie.setpoints.sample": [
        ("sign", "-rates.y", "rates.y"),
        ("timestamps", "1000 * timestamp_ms", "timestamp_ms"),
        ("wxyz", "(q.w, q.x, q.y, q.z)", "(q.x, q.y, q.z, q.w)"),
    ],
    "quad_crazyflie.setpoints.unpacked": [("wxyz", "(3, 2, 1, 0)", "(0, 1, 2, 3)")],
    "quad_crazyflie.vehicle.CrazyflieVehicle.request": [
        ("landing", "send_notify_setpoint_stop()", "send_stop_setpoint()"),
        ("arming", "send_arming_request(self._is_armed)", "send_arming_request(False)"),
        ("landing", "max(height / self.settings.landing_speed, 1.0)", "height"),
    ],
    "quad_crazyflie.vehicle.CrazyflieVehicle.idle": [("clip", "0.0, 0)", "0.0, 10001)")],
    "quad_crazyflie.vehicle.CrazyflieVehicle.fly": [("rates", "rate=False", "rate=True")],
    "quad_crazyflie.vehicle.CrazyflieVehicle.autopilot": [
        ("takeover", "Control.OTHER if others else control", "control"),
        ("arming", " and (not faults)", ""),
    ],
    "quad_crazyflie.vehicle.CrazyflieVehicle.close": [("landing", "self._cf.link.close()", "self._cf.close_link()")],
}

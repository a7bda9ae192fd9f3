"""A vehicle file from what was told: as ``fly``, the bridges and ``tune`` take it."""

from typing import Any

import numpy as np

from quad_core.parameters import ParameterError, Value
from quad_core.vehicle import ARRANGEMENTS, Vehicle, check_inertia
from quad_identify.identify import Result
from quad_identify.record import RecordError
from quad_identify.verdict import TORQUES

FULL_SPEED = 1000.0  # rad/s at the full command, where no speeds were logged: only their ratio matters
GRAVITY = 9.81
NEEDED = {"specific_thrust": "thrust_to_weight", "inertia_xx": "inertia_xx", "inertia_yy": "inertia_yy"}
FLAT = 0.88  # J_zz over J_xx + J_yy where no log told it


def vehicle_values(
    result: Result, arms: tuple[float, float], layout: str, prior: dict[str, Value]
) -> dict[str, tuple[float | str, str]]:
    """Return {key of the vehicle file: (value, where it is from)}; ``prior`` fills in what was not told.

    Raises RecordError naming what is neither told nor in ``prior``.
    """
    mass = result.told("mass")
    if mass is None:
        raise RecordError("mass: no flight tells it, and a vehicle file needs it: weigh the vehicle and give --mass")
    lacking = [name for name, key in NEEDED.items() if result.told(name) is None and key not in prior]
    if lacking:
        why = "; ".join(f"{name}: {result.parameters[name].why}" for name in lacking)
        raise RecordError(f"no vehicle file: {why}. --prior FILE takes it from a vehicle file that you have")
    arm = float(np.hypot(*arms)) if layout != "plus" else max(arms)
    speed, assumed = (result.full_speed, "") if result.full_speed else (FULL_SPEED, " (assumed)")
    out: dict[str, tuple[Any, str]] = {
        "mass": (mass, "kg: given"),
        "gravity": (GRAVITY, "m/s^2"),
        "arm_length": (arm, "m: given"),
    }

    def take(key: str, name: str, factor: float = 1.0, otherwise: float = 0.0, words: str = "not told") -> None:
        """Write what was told times ``factor``, else the prior's value, else ``otherwise``."""
        found = result.parameters[name]
        if found.told and isinstance(found.value, float):
            low, high = (factor * float(end) for end in (found.low, found.high))  # type: ignore[arg-type]
            out[key] = (factor * found.value, f"{name}: 95 % in [{low:.4g}, {high:.4g}]")
        else:
            out[key] = (prior[key], "prior") if key in prior else (otherwise, words)

    take("thrust_to_weight", "specific_thrust", 1.0 / GRAVITY)
    for name, length in (("inertia_xx", arms[1]), ("inertia_yy", arms[0])):
        take(name, name, arm / length * (1.0 if layout == "plus" else float(np.sqrt(0.5))))  # one arm, equal rotation
    out["layout"] = ("plus" if layout == "plus" else "x", f"rotors of the plant; those of the log: {layout}")
    flat = FLAT * (out["inertia_xx"][0] + out["inertia_yy"][0])
    take("inertia_zz", "inertia_zz", 1.0, flat, "kg m^2: not told; of a flat body")
    lift = float(out["thrust_to_weight"][0]) * mass * GRAVITY / 4.0 / speed**2
    out["lift_coefficient"] = (lift, f"N s^2: full command is {speed:.0f} rad/s{assumed}")
    if {"torque_coefficient", "lift_coefficient"} <= prior.keys():  # at the speed that full command means here
        yaw = float(prior["torque_coefficient"]) / float(prior["lift_coefficient"])
        prior = prior | {"torque_coefficient": yaw * lift}
    per = lift * float(out["inertia_zz"][0]) / mass
    take("torque_coefficient", TORQUES[2], per, 0.1 * arm * lift, "N m s^2: not told; a tenth of an arm")
    take("rotor_time_constant", "rotor_time_constant", words="s: not told")
    take("drag_coefficient", "linear_drag", mass, words="N s/m: not told")
    out["drag_coefficient"] = (max(0.0, out["drag_coefficient"][0]), out["drag_coefficient"][1])
    out["drag_torque_coefficient"] = (prior.get("drag_torque_coefficient", 0.0), "N m s^2: not told")
    return out


def bridge_sections(result: Result, values: dict[str, tuple[float | str, str]], arms: tuple[float, float]) -> str:
    """Return what bridges take of the vehicle: {node: largest thrust of a rotor in N, curve, drag ratio, places}.

    The curve k u^2 + (1 - k) u goes through the command and the thrust of the hover that was identified.
    """
    number = {key: float(value) for key, (value, _) in values.items() if not isinstance(value, str)}
    largest = 0.25 * number["thrust_to_weight"] * number["mass"] * GRAVITY
    found = [result.told(name) for name in ("thrust_offset", "thrust_linear", "thrust_square")]
    if None in found:
        return ""
    offset, linear, square = (float(part or 0.0) for part in found)
    roots = np.roots([square, linear, offset - GRAVITY]) if abs(square) > 1e-9 else [(GRAVITY - offset) / linear]
    hover = min((float(u.real) for u in np.atleast_1d(roots) if abs(u.imag) < 1e-9 and 0.0 < u.real < 1.0), default=0.5)
    curve = min(1.0, max(0.0, (hover - 1.0 / number["thrust_to_weight"]) / (hover - hover * hover)))
    thrust, shape = f"max_rotor_thrust: {largest:.6g}", f"thrust_curve: {curve:.4f}"
    ratio = number["torque_coefficient"] / number["lift_coefficient"]
    out = [f"# For --vehicle-interface NAME=FILE: hover at {hover:.4f} of the full command."]
    for node in ("mavlink_bridge", "crazyflie_bridge"):
        out += [f"/**/{node}:", "  ros__parameters:", f"    {thrust}", f"    {shape}"]
    if values["layout"][0] == "x":
        out += ["/**/px4_bridge:", "  ros__parameters:", "    airframe:", f"      {thrust}", f"      {shape}"]
        out += [f"      drag_ratio: {ratio:.6g}", "      # thr_mdl_fac: as THR_MDL_FAC is set in PX4, if it is not 0.0"]
        for index, (forward, left, yaw) in enumerate(zip(*ARRANGEMENTS["px4"], strict=True)):
            px, py, km = forward * arms[0], -left * arms[1], -yaw * ratio
            out.append(f"      rotor{index}: {{px: {px:.6g}, py: {py:.6g}, km: {km:.6g}}}")
    return "\n".join(out) + "\n"


def vehicle_text(values: dict[str, tuple[float | str, str]], delay: float | None, title: str) -> str:
    """Return the file; raises RecordError if no body has such moments of inertia."""
    numbers: dict[str, Any] = {key: value for key, (value, _) in values.items() if not isinstance(value, str)}
    try:
        check_inertia(Vehicle()._replace(**numbers))
    except ParameterError as error:
        raise RecordError(f"{error}: check mass and arms") from error
    lines = [f"# {title}", "/**:", "  ros__parameters:", "    vehicle:"]
    for key, (value, why) in values.items():
        text = value if isinstance(value, str) else f"{value:.6g}"
        if isinstance(value, float) and "." not in text and "e" not in text:
            text += ".0"
        elif "e" in text and "." not in text:
            text = text.replace("e", ".0e")
        lines.append(f"      {f'{key}: {text}':<38} # {why}")
    if delay is not None:
        lines.insert(
            1, f"# Delay from command to force: {1e3 * delay:.1f} ms: a scenario's event `link delay={delay:.4f}`."
        )
    return "\n".join(lines) + "\n"

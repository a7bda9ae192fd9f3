"""A vehicle file from what was told: as ``fly``, the bridges and ``tune`` take it."""

from typing import Any

import numpy as np

from quad_core.parameters import ParameterError
from quad_core.vehicle import ARRANGEMENTS, Vehicle, check_inertia
from quad_identify.identify import Result
from quad_identify.record import RecordError

FULL_SPEED = 1000.0  # rad/s at the full command, where no speeds were logged: only their ratio matters
GRAVITY = 9.81
NEEDED = ("specific_thrust", "inertia_xx", "inertia_yy")
FLAT = 0.88  # J_zz over J_xx + J_yy where no log told it


def vehicle_values(
    result: Result, arms: tuple[float, float], layout: str, prior: dict[str, float | str]
) -> dict[str, tuple[float | str, str]]:
    """Return {key of the vehicle file: (value, where it is from)}; ``prior`` fills in what was not told.

    Raises RecordError naming what is neither told nor in ``prior``.
    """
    mass = result.told("mass")
    if mass is None:
        raise RecordError("mass: no flight tells it, and a vehicle file needs it: weigh the vehicle and give --mass")
    lacking = [name for name in NEEDED if result.told(name) is None and _in_prior(name) not in prior]
    if lacking:
        why = "; ".join(f"{name}: {result.parameters[name].why}" for name in lacking)
        raise RecordError(f"no vehicle file: {why}. --prior FILE takes it from a vehicle file that you have")
    arm = float(np.hypot(*arms)) if layout != "plus" else max(arms)
    levers = np.array([arms[1], arms[0]]) / (arm if layout == "plus" else arm * np.sqrt(0.5))
    out: dict[str, tuple[float | str, str]] = {
        "mass": (mass, "kg: given"),
        "gravity": (GRAVITY, "m/s^2"),
        "arm_length": (arm, "m: given"),
    }
    top = result.told("specific_thrust")
    ratio = top / GRAVITY if top is not None else prior["thrust_to_weight"]
    out["thrust_to_weight"] = (ratio, _from(result, "specific_thrust", 1.0 / GRAVITY))
    for axis, name in enumerate(("inertia_xx", "inertia_yy")):
        found = result.told(name)
        lever = float(levers[axis])  # the file has one arm: the moment is scaled so that the rotation is the same
        out[name] = (found / lever, _from(result, name, 1.0 / lever)) if found is not None else (prior[name], "prior")
    out["layout"] = ("plus" if layout == "plus" else "x", "rotors of the plant; those of the log: " + layout)
    return out | _lesser(result, prior, mass, out)


def _lesser(
    result: Result, prior: dict[str, float | str], mass: float, known: dict[str, tuple[float | str, str]]
) -> dict[str, tuple[float | str, str]]:
    """Return the keys that a flight needs less: ``known`` are those before them."""
    out: dict[str, tuple[float | str, str]] = {}
    arm, ratio = float(known["arm_length"][0]), known["thrust_to_weight"][0]
    flat = FLAT * (float(known["inertia_xx"][0]) + float(known["inertia_yy"][0]))
    zz = result.told("inertia_zz")
    out["inertia_zz"] = (
        (zz, _from(result, "inertia_zz"))
        if zz is not None
        else (prior.get("inertia_zz", flat), "kg m^2: not told; of a flat body")
    )
    speed = result.full_speed or FULL_SPEED
    lift = float(ratio) * mass * GRAVITY / 4.0 / speed**2
    out["lift_coefficient"] = (
        lift,
        f"N s^2: full command is {speed:.0f} rad/s{'' if result.full_speed else ' (assumed)'}",
    )
    yaw = result.told("yaw_torque_per_inertia")
    if yaw is not None:
        out["torque_coefficient"] = (
            lift * yaw * float(out["inertia_zz"][0]) / mass,
            "N m s^2: from yaw torque per inertia",
        )
    else:
        out["torque_coefficient"] = (
            prior.get("torque_coefficient", 0.1 * arm * lift),
            "N m s^2: not told; a tenth of an arm",
        )
    lag, drag = result.told("rotor_time_constant"), result.told("linear_drag")
    out["rotor_time_constant"] = (
        (lag, _from(result, "rotor_time_constant"))
        if lag is not None
        else (prior.get("rotor_time_constant", 0.0), "s: not told")
    )
    out["drag_coefficient"] = (
        (max(drag, 0.0) * mass, _from(result, "linear_drag", mass))
        if drag is not None
        else (prior.get("drag_coefficient", 0.0), "N s/m: not told")
    )
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


def _in_prior(name: str) -> str:
    return "thrust_to_weight" if name == "specific_thrust" else name


def _from(result: Result, name: str, factor: float = 1.0) -> str:
    found = result.parameters[name]
    if not found.told or not isinstance(found.low, float) or not isinstance(found.high, float):
        return "prior"
    return f"{name}: 95 % in [{factor * found.low:.4g}, {factor * found.high:.4g}]"


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
            1,
            f"# Delay from command to force: {1e3 * delay:.1f} ms: a scenario's event `link delay={delay:.4f}`.",
        )
    return "\n".join(lines) + "\n"

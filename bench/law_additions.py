"""Every addition to the paper's laws as the parameters that take it out, and out of which preset it can be taken."""

from typing import NamedTuple

from paper_flight import PaperCase

from quad_attitude_ctrl import abfnitsm
from quad_core.parameters import Value, build, flatten
from quad_position_ctrl import aibs

XYZ = ("x", "y", "z")
RPY = ("roll", "pitch", "yaw")


class Addition(NamedTuple):
    """One addition: its name and the values, per law, that stand for its absence."""

    name: str
    position: dict[str, Value]
    attitude: dict[str, Value]


def _each(axes: tuple[str, ...], name: str, value: Value) -> dict[str, Value]:
    return {f"{axis}.{name}": value for axis in axes}


FLYING = (
    Addition("corrected drag signs (5, 9)", {"drag_sign": "printed"}, {"drag_sign": "printed"}),
    Addition(
        "bounded virtual velocity (23)",
        {f"speed.{name}": 1e6 for name in ("max_xy", "max_z", "braking_xy", "braking_z")},
        {},
    ),
    Addition("bounded acceleration (30)", {"limits.acceleration_xy": 1e6, "limits.acceleration_z": 1e6}, {}),
    Addition("floor of the lift (38)", {"limits.min_lift": -1e6}, {}),
    Addition("thrust limits in the law (38)", {"limits.thrust": 1e6, "limits.min_thrust": 0.0}, {}),
    Addition("vertical priority (38)", {"limits.vertical_priority": False}, {}),
    Addition("tilt limit (38)", {"limits.tilt": 1.58}, {}),
    Addition("bounded gain (37)", _each(XYZ, "max_gain", 1e9), {}),
    Addition("bounded integral (21)", _each(XYZ, "max_integral", 1e9), {}),
    Addition("anti-windup, position", {"anti_windup": False}, {}),
    Addition("torque limit (56)", {}, _each(RPY, "max_torque", 1e6)),
    Addition("bounded surface integral (45)", {}, _each(RPY, "max_surface_integral", 1e9)),
    Addition("bounded estimates (54)", {}, _each(RPY, "max_estimate", 1e9)),
    Addition("anti-windup, attitude", {}, {"anti_windup": False}),
    Addition("slow yaw command", {}, {"yaw.filter.bandwidth": 40.0, "yaw.filter.max_rate": 1e6}),
)
"""What makes flying possible; ``printed`` has none of it, ``tuned`` all."""

TUNING = (
    Addition("disturbance estimate (30)", {"observer.bandwidth": 0.0}, {}),
    Addition("projected thrust (38)", {"thrust_form": "norm"}, {}),
    Addition("tilt in the measured heading (38)", {"tilt_heading": "reference"}, {}),
    Addition("xi_hat(0) = 7, not 1 (37)", _each(XYZ, "initial_gain", 1.0), {}),
    Addition("leak of the gain (37)", _each(XYZ, "adaptation_leak", 0.0), {}),
    Addition("exact mapping to torque (14)", {}, {"mapping": "printed"}),
    Addition("rho_1 = 20, not 3 (53)", {}, _each(RPY, "linear_gain", 3.0)),
    Addition("layer 0.05, not 1 (45)", {}, _each(RPY, "surface_width", 1.0)),
)
"""What makes ``tuned`` more accurate."""

FILTER = Addition("command filter (41)", {}, {"command": "raw"})
"""In all presets: the paper uses x_1d' and x_1d'' and defines neither."""


def without(paper_case: PaperCase, addition: Addition) -> PaperCase:
    """Return ``paper_case`` with one addition taken out."""
    return paper_case._replace(
        position={**paper_case.position, **addition.position}, attitude={**paper_case.attitude, **addition.attitude}
    )


def held_by(preset: str) -> list[Addition]:
    """Return the additions that ``preset`` has; ``flying`` is Table 2 with all that makes flying possible."""
    if preset == "flying":
        return [FILTER, *FLYING]
    position, attitude = (flatten(build(law.Parameters, law.PRESETS[preset])) for law in (aibs, abfnitsm))
    return [
        addition
        for addition in (FILTER, *FLYING, *TUNING)
        if any(position[name] != value for name, value in addition.position.items())
        or any(attitude[name] != value for name, value in addition.attitude.items())
    ]


def printed_with(paper_case: PaperCase, chosen: tuple[Addition, ...]) -> PaperCase:
    """Return the preset ``printed`` with the values that ``tuned`` has for the ``chosen`` additions."""
    position, attitude = flatten(aibs.Parameters()), flatten(abfnitsm.Parameters())
    return paper_case._replace(
        preset="printed",
        position={name: position[name] for addition in chosen for name in addition.position},
        attitude={name: attitude[name] for addition in chosen for name in addition.attitude},
    )

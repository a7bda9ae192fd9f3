"""A campaign as its YAML file tells it: which flight, what varies how, and what counts as success.

Keys: ``flight`` (as ``scripts/fly`` takes it: ``case``, ``preset``, ``vehicle``, ``plant``, ``start``, ``position``,
``attitude``, ``scenario``, ``duration``, ``set``: list of NODE.PARAM=VALUE), ``vary`` ({parameter: distribution}),
``success`` ({``rmse`` or ``largest_error``: largest value in m}), ``seed`` and ``about``. Distributions:
``uniform: [low, high]``, ``normal: [mean, sd]``, ``choice: [value, ...]``; ``within: [low, high]`` cuts a normal one.
The values of flight n come from (seed, n, parameter) alone, so any flight can be flown again by its number.
"""

import math
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from quad_core.parameter_files import StrictLoader, load_yaml_file
from quad_core.parameters import ParameterError, Real, Value
from quad_flight.flight import Flight, flight_from_resolved
from quad_flight.set_up import Request, resolve_flight
from quad_flight.variation import SEED, Variation

_LARGEST_SEED = 2**31 - 1
_KEYS = ("about", "flight", "vary", "success", "seed")
_FLIGHT = ("case", "preset", "vehicle", "plant", "start", "position", "attitude", "scenario", "duration", "set")
_SUCCESS = ("rmse", "largest_error")
_TRIES = 10_000


class Distribution(NamedTuple):
    """How one parameter varies: ``uniform`` and ``normal`` with two numbers, or ``choice`` of values."""

    kind: str
    values: tuple[Value, ...]
    within: tuple[float, float] | None


class Definition(NamedTuple):
    """One campaign. ``flight``: the choices of scripts/fly; ``success``: {figure: largest value in m}."""

    name: str
    about: str
    flight: dict[str, Any]
    vary: dict[str, Distribution]
    success: dict[str, float]
    seed: int


def read_definition(path: Path) -> Definition:
    """Read a campaign file; raises ParameterError naming file and key, what was found and what was expected."""
    try:
        content = load_yaml_file(path, StrictLoader)
    except OSError as error:
        raise ParameterError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise ParameterError(f"{path}: {error}") from error
    _only(path, "", content, _KEYS)
    flight = content.get("flight", {})
    _only(path, "flight", flight, _FLIGHT)
    if "case" not in flight:
        raise ParameterError(f"{path}: flight.case: found nothing, expected the case to fly")
    for key, value in flight.items():
        texts, expected = (value, "a list of texts") if key == "set" else ([value], "text")
        if key != "duration" and not (isinstance(texts, list) and all(isinstance(each, str) for each in texts)):
            raise ParameterError(f"{path}: flight.{key}: found {value!r}, expected {expected}")
    vary = content.get("vary", {})
    _only(path, "vary", vary, None)
    success = content.get("success", {})
    _only(path, "success", success, _SUCCESS)
    for key, limit in success.items():
        if not _is_number(limit) or not limit > 0.0:
            raise ParameterError(f"{path}: success.{key}: found {limit!r}, expected a positive number of m")
    seed = content.get("seed", 1)
    if not _is_number(seed) or not isinstance(seed, int) or seed < 0:
        raise ParameterError(f"{path}: seed: found {seed!r}, expected an integer of at least 0")
    distributions = {name: _distribution(f"{path}: vary.{name}", value) for name, value in vary.items()}
    distributions.setdefault(SEED, Distribution("uniform", (0, _LARGEST_SEED), None))
    return Definition(path.stem, str(content.get("about", "")), flight, distributions, success, seed)


def base_flight(definition: Definition, values: Mapping[str, Value] | None = None) -> Flight:
    """Return the flight that varies, with ``values``; raises ParameterError or PluginError as scripts/fly would."""
    return flight_from_resolved(resolve_flight(request(definition, values or {}), {}))


def request(definition: Definition, values: Mapping[str, Value]) -> Request:
    """Return what scripts/fly would be asked for to fly the campaign's flight with ``values``."""
    choices = {key: value for key, value in definition.flight.items() if key != "set"}
    return Request(**choices, settings=[*definition.flight.get("set", []), *settings_of(values)])


def settings_of(values: Mapping[str, Value]) -> list[str]:
    """Return NODE.PARAM=VALUE of each value, to the last bit."""
    return [f"{name}={value!r}" if not isinstance(value, str) else f"{name}={value}" for name, value in values.items()]


def command(definition: Definition, values: Mapping[str, Value]) -> list[str]:
    """Return the arguments of scripts/fly that fly the campaign's flight with ``values`` over ROS."""
    flight = definition.flight
    words = [str(flight["case"])]
    for key in _FLIGHT[1:-1]:
        if key in flight:
            words += [f"--{key}", str(flight[key])]
    for setting in [*flight.get("set", []), *settings_of(values)]:
        words += ["--set", setting]
    return words


def drawn(definition: Definition, variation: Variation, number: int) -> dict[str, Value]:
    """Return the values of flight ``number``: from the campaign's seed, the number and the parameter's name alone."""
    values: dict[str, Value] = {}
    for name, how in definition.vary.items():
        key = [definition.seed, number, zlib.crc32(name.encode())]
        stream = np.random.Generator(np.random.PCG64(np.random.SeedSequence(key)))
        try:
            values[name] = _draw(how, stream, isinstance(variation.field(name).spec, Real))
        except (ValueError, OverflowError) as error:
            raise ParameterError(f"{definition.name}: vary.{name}.{how.kind}: found {how.values}: {error}") from error
    return values


def _draw(how: Distribution, stream: np.random.Generator, real: bool) -> Value:
    if how.kind == "choice":
        return how.values[int(stream.integers(len(how.values)))]
    first, second = (float(value) for value in how.values)
    if how.kind == "uniform":
        if not real and not (first.is_integer() and second.is_integer()):
            raise ParameterError("expected integers, as the parameter is one")
        return float(stream.uniform(first, second)) if real else int(stream.integers(int(first), int(second) + 1))
    low, high = how.within or (-np.inf, np.inf)
    for _ in range(_TRIES):
        value = float(stream.normal(first, second))
        if low <= value <= high:
            return value
    raise ParameterError(f"no value within [{low}, {high}] in {_TRIES} tries, expected a wider range")


def _distribution(where: str, spec: Any) -> Distribution:
    _only(where, "", spec, ("uniform", "normal", "choice", "within"))
    kinds = [kind for kind in ("uniform", "normal", "choice") if kind in spec]
    if len(kinds) != 1:
        raise ParameterError(f"{where}: found {spec!r}, expected one of uniform, normal, choice")
    kind = kinds[0]
    values = spec[kind]
    if "within" in spec and kind != "normal":
        raise ParameterError(f"{where}: found within with {kind}, expected it with normal alone")
    if not isinstance(values, list) or not values:
        raise ParameterError(f"{where}.{kind}: found {values!r}, expected a list")
    if kind == "choice":
        return Distribution(kind, tuple(values), None)
    pair = _pair(f"{where}.{kind}", values)
    if not (all(map(math.isfinite, pair)) and pair[1] >= (pair[0] if kind == "uniform" else 0.0)):
        expected = "low <= high" if kind == "uniform" else "a standard deviation of at least 0"
        raise ParameterError(f"{where}.{kind}: found {values!r}, expected {expected}, both finite")
    within = _pair(f"{where}.within", spec["within"]) if "within" in spec else None
    return Distribution(kind, pair, within)


def _pair(where: str, values: Any) -> tuple[float, float]:
    numbers = isinstance(values, list) and all(map(_is_number, values))
    if not numbers or len(values) != 2:
        raise ParameterError(f"{where}: found {values!r}, expected two numbers")
    return values[0], values[1]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _only(where: Any, key: str, content: Any, known: tuple[str, ...] | None) -> None:
    place = f"{where}: {key}" if key else f"{where}"
    if not isinstance(content, dict):
        raise ParameterError(f"{place}: found {content!r}, expected keys with values")
    for name in content:
        if known is not None and name not in known:
            raise ParameterError(f"{place}: found the key {name!r}, expected one of {', '.join(known)}")

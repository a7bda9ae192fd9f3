"""The plan of a study as YAML: controllers, knobs with bounds, objective, conditions, seeds; the gains it led to."""

import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from quad_core.cascade import VEHICLE_INTERFACES
from quad_core.parameter_files import StrictLoader, read_parameter_file
from quad_core.parameters import Field, Flag, ParameterError, Real, Spec, Text, Value, Whole, checked, nearest
from quad_core.plugins import PluginError
from quad_core.resolution import resolve
from quad_flight import set_up
from quad_flight.flight import Flight, flight_from_parameters

Overrides = dict[str, dict[str, Value]]
_COUNT, _SEED, _TEXT, _MAPPING = Whole("", "", 1, 10**9), Whole("", "", 0, 10**9), Text(""), dict
_SCALE, _BOUND = Real("", "", 1e-12, 1e12), Real("", "", -1e12, 1e12)
# {section: {key: what it may be}}; [kind] is a list of it
_TOP = {"name": _TEXT, "tuning": _MAPPING, "study": _MAPPING, "controllers": _MAPPING}
_TUNING = {
    "trials": _COUNT,
    "tunings": _COUNT,
    "seeds": [_SEED],
    "cases": [_TEXT],
    "plants": [_TEXT],
    "objective": _MAPPING,
}
_OBJECTIVE = {"rmse_scale": _SCALE, "variation_scale": _SCALE, "failure": _SCALE}
_STUDY = {
    "held_out_first": _SEED,
    "cases": [_TEXT],
    "plants": [_TEXT],
    "start": _TEXT,
    "resamples": _COUNT,
    "bootstrap_seed": _SEED,
}
_LAWS = {"title": _TEXT, "position": _TEXT, "attitude": _TEXT}
_FREE = {"fixed": _MAPPING, "knobs": _MAPPING}
_KNOB = {"node": _TEXT, "parameters": [_TEXT]}
_BOUNDS = {"low": _BOUND, "high": _BOUND, "log": Flag("")}
_NODES = {"position_controller": "position", "attitude_controller": "attitude"}


class Knob(NamedTuple):
    """One number to tune: it sets all ``parameters`` (dotted, law's name included) of ``node`` to one value."""

    name: str
    node: str
    parameters: tuple[str, ...]
    low: float
    high: float
    log: bool


class Controller(NamedTuple):
    """A position law and an attitude law, what is ``fixed`` about them, and what may be tuned."""

    name: str
    title: str
    position: str
    attitude: str
    fixed: Overrides
    knobs: tuple[Knob, ...]

    def overrides(self, values: Mapping[str, float]) -> Overrides:
        """Return {node: {parameter: value}} for {knob name: value}; knobs without a value stay at their defaults."""
        found: Overrides = {
            "position_controller": {"law": self.position, **self.fixed.get("position_controller", {})},
            "attitude_controller": {"law": self.attitude, **self.fixed.get("attitude_controller", {})},
        }
        for knob in self.knobs:
            if knob.name in values:
                found[knob.node].update(dict.fromkeys(knob.parameters, float(values[knob.name])))
        return found


class Objective(NamedTuple):
    """What tuning minimises: scales in m and N m/s, and what a flight costs that does not end."""

    rmse_scale: float
    variation_scale: float
    failure: float


class Condition(NamedTuple):
    """What acts besides in a flight, {node or "/**": {parameter: value}}, for example a vehicle, noise, delay, wind."""

    name: str
    overrides: Overrides


class Tuning(NamedTuple):
    """Budget and flights of each tuning of a controller; every flight is flown under each of ``conditions``.

    A controller is tuned ``tunings`` times, by the sampler's seeds 1, 2, ...
    """

    trials: int
    tunings: int
    seeds: tuple[int, ...]
    cases: tuple[str, ...]
    plants: tuple[str, ...]
    objective: Objective
    conditions: tuple[Condition, ...]


class Comparison(NamedTuple):
    """Held-out flights and how they are compared."""

    held_out_first: int
    cases: tuple[str, ...]
    plants: tuple[str, ...]
    start: str
    resamples: int
    bootstrap_seed: int
    conditions: tuple[Condition, ...]

    def seeds(self, count: int) -> list[int]:
        """Return the first ``count`` held-out seeds."""
        return list(range(self.held_out_first, self.held_out_first + count))


class StudyPlan(NamedTuple):
    """A whole plan, as read from ``path``; ``gains``: folder of the tuned gains, next to it if not said otherwise."""

    path: Path
    name: str
    tuning: Tuning
    study: Comparison
    controllers: tuple[Controller, ...]
    gains: Path


def find_plan(name: str) -> Path:
    """Return the plan ``name`` stands for: ``paper``, or the path of a YAML file. Raises ParameterError if none."""
    if name == "paper":
        return Path(__file__).with_name("study.yaml")
    if name.endswith((".yaml", ".yml")) and Path(name).is_file():
        return Path(name)
    raise ParameterError(f"plan: found {name!r}, expected paper or the path of a YAML file")


def read_plan(path: Path) -> StudyPlan:
    """Return the plan of a YAML file.

    Raises ParameterError naming file and key: not readable, a key missing or unknown, a held-out seed among those of
    the training, a knob of a parameter that does not exist or with bounds outside of the parameter's.
    """
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), StrictLoader)
    except (OSError, yaml.YAMLError, UnicodeDecodeError, ParameterError) as error:
        raise ParameterError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    try:
        plan = _plan(path, content)
        _check(plan)
    except (ParameterError, PluginError) as error:
        raise ParameterError(f"{path}: {error}") from error
    return plan


def only(plan: StudyPlan, names: Sequence[str]) -> StudyPlan:
    """Return ``plan`` with only these of its controllers, all if none is named. Raises ParameterError for another."""
    known = {controller.name: controller for controller in plan.controllers}
    for name in names:
        if name not in known:
            raise ParameterError(f"--only: found {name!r}, expected one of {', '.join(known)}")
    return plan._replace(controllers=tuple(body for name, body in known.items() if name in (names or known)))


def plan_mark(plan: StudyPlan) -> str:
    """Return a hash of the plan's file and of what its conditions mean: fixed before a held-out flight, and shown."""
    return hashlib.sha256(plan.path.read_bytes() + repr(plan.study.conditions).encode()).hexdigest()[:16]


def tuning_mark(plan: StudyPlan, controller: Controller) -> str:
    """Return a hash of all in the plan that decides the gains of a controller: they belong to no other plan."""
    return hashlib.sha256(repr((plan.tuning, controller)).encode()).hexdigest()[:16]


def gains_file(plan: StudyPlan, controller: str, tuning: int) -> Path:
    """Return where the gains of a controller's tuning stand: a ROS parameter file."""
    return plan.gains / str(tuning) / f"{controller}.yaml"


def tuned_overrides(plan: StudyPlan, controller: Controller, tuning: int) -> Overrides:
    """Return {node: {parameter: value}} of the tuned gains.

    Raises ParameterError if they were not tuned yet, or from another plan than this.
    """
    path, mark = gains_file(plan, controller.name, tuning), tuning_mark(plan, controller)
    if not path.is_file():
        raise ParameterError(f"{path}: found no tuned gains; run: scripts/tune {plan.path}")
    found = re.search("^# tuning: (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    if found is None or found[1] != mark:
        raise ParameterError(f"{path}: found gains of tuning {found and found[1]}, expected {mark}; tune again")
    return {pattern.strip("/*"): values for pattern, values in read_parameter_file(path).items()}


def flight_of(
    overrides: Overrides, case: str, plant: str, start: str = "approach", condition: Overrides | None = None
) -> Flight:
    """Return the flight of a controller on a case and a plant, at the default seed. Raises as the nodes would.

    ``condition``: {node or "/**": {parameter: value}} that acts besides, for example noise, delay and a vehicle; what a
    controller sets itself wins.
    """
    acting = condition or {}
    asked: Overrides = {
        **acting,
        **{node: {**acting.get(node, {}), **values} for node, values in overrides.items()},
        "trajectory": {**acting.get("trajectory", {}), "trajectory": case, f"{case}.start": start},
        # laws are compared, not the net under them
        "simulator": {**acting.get("simulator", {}), "plant": plant, "guard.enabled": False},
    }
    return flight_from_parameters(asked)


def read_conditions(place: str, body: Any) -> tuple[Condition, ...]:
    """Return the conditions of a mapping {name: {node: {parameter: value}, vehicle: NAME, levels: [NAME, ...]}}.

    ``levels`` are those of levels.yaml. Raises ParameterError for another form or an unknown name; parameters are
    checked with the first flight.
    """
    if not isinstance(body, dict) or not body or not all(re.fullmatch(r"[\w-]+", str(name)) for name in body):
        raise ParameterError(f"{place}: found {body!r}, expected {{name: {{node: {{parameter: value}}, ...}}}}")
    return tuple(Condition(str(name), _condition(f"{place}.{name}", entry or {})) for name, entry in body.items())


def _condition(place: str, entry: Any) -> Overrides:
    kinds = {"vehicle": str, "levels": list}
    if not isinstance(entry, dict) or not all(isinstance(each, kinds.get(key, dict)) for key, each in entry.items()):
        raise ParameterError(f"{place}: found {entry!r}, expected node: {{...}}, vehicle: NAME, levels: [NAME, ...]")
    parts: list[tuple[str, Any]] = []
    if "vehicle" in entry:
        sections = read_parameter_file(set_up.shipped_file(set_up.VEHICLES, entry["vehicle"])).items()
        # a vehicle's file may say what a bridge to it needs
        parts += [each for each in sections if each[0].rpartition("/")[2] not in VEHICLE_INTERFACES]
    known = yaml.load((Path(__file__).with_name("levels.yaml")).read_text(encoding="utf-8"), StrictLoader)
    for level in entry.get("levels", ()):
        if level not in known:
            raise ParameterError(f"{place}.levels: found {level!r}, expected one of {', '.join(known)}")
        parts += known[level].items()
    found: Overrides = {}
    for node, values in parts + [(key, each) for key, each in entry.items() if key not in kinds]:
        twice = {"timeline.events"} & found.get(node, {}).keys() & values.keys()
        if twice:
            raise ParameterError(f"{place}: found timeline.events twice, expected the events of one level")
        found.setdefault(node, {}).update(values)
    return found


def _plan(path: Path, content: Any) -> StudyPlan:
    top = _section(content, "", _TOP, {"parts": _MAPPING})
    tuning = _section(top["tuning"], "tuning", _TUNING, {"conditions": None})
    objective = _section(tuning["objective"], "tuning.objective", _OBJECTIVE, {})
    study = _section(top["study"], "study", _STUDY, {"conditions": None})
    tuned = read_conditions("tuning.conditions", tuning.get("conditions", {"nominal": {}}))
    flown = read_conditions("study.conditions", study["conditions"]) if "conditions" in study else tuned
    if not top["controllers"]:
        raise ParameterError("controllers: expected names with laws and knobs")
    return StudyPlan(
        path,
        top["name"],
        Tuning(**{**tuning, "objective": Objective(**objective), "conditions": tuned}),
        Comparison(**{**study, "conditions": flown}),
        tuple(_controller(str(name), body, top.get("parts", {})) for name, body in top["controllers"].items()),
        path.parent / f"{path.stem}_gains",
    )


def _section(content: Any, name: str, keys: Mapping[str, Any], optional: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a section, each of the kind that its key may have; what is None stays as it is."""
    expected = f"expected the keys {', '.join(keys)}"
    if not isinstance(content, dict):
        raise ParameterError(f"{name or 'top'}: found {type(content).__name__}, {expected}")
    missing = [key for key in keys if key not in content]
    unknown = [key for key in content if key not in (*keys, *optional)]
    if missing or unknown:
        raise ParameterError(f"{name or 'top'}: found {', '.join(map(str, content))}, {expected}")
    kinds = {**keys, **optional}
    return {key: _of_kind(f"{name}.{key}".lstrip("."), kinds[key], value) for key, value in content.items()}


def _of_kind(place: str, kind: Spec | list[Spec] | type[dict[str, Any]] | None, value: Any) -> Any:
    """Return ``value`` as what ``kind`` says, else raise ParameterError saying found and expected."""
    if kind is None:
        return value
    if kind is _MAPPING:
        if not isinstance(value or {}, dict):
            raise ParameterError(f"{place}: found {value!r}, expected keys with values")
        return value or {}
    if isinstance(kind, list):
        if not isinstance(value, list) or not value:
            raise ParameterError(f"{place}: found {value!r}, expected a list of one value or more")
        return tuple(_of_kind(f"{place}[{index}]", kind[0], each) for index, each in enumerate(value))
    return checked(Field(place, kind, 0), value)


def _controller(name: str, body: Any, parts: Any) -> Controller:
    place = f"controllers.{name}"
    found = _section(body, place, _LAWS, {"parts": [_TEXT], **_FREE})
    laws = {node: found[key] for node, key in _NODES.items()}
    fixed: Overrides = {}
    knobs: dict[str, Knob] = {}
    for shared in [*found.get("parts", ()), None]:
        if shared is not None and shared not in parts:
            raise ParameterError(f"{place}.parts: found {shared!r}, expected one of {', '.join(parts) or 'none'}")
        there = f"{place}" if shared is None else f"parts.{shared}"
        part = found if shared is None else _section(parts[shared], there, {}, _FREE)
        for node, values in part.get("fixed", {}).items():
            if node not in laws:
                raise ParameterError(f"{there}.fixed.{node}: expected one of {', '.join(laws)}")
            for key, value in _of_kind(f"{there}.fixed.{node}", _MAPPING, values).items():
                full = _full_name(laws[node], key)
                _spec(f"{there}.fixed.{node}.{key}", node, laws[node], full)
                fixed.setdefault(node, {})[full] = value
        for key, knob in part.get("knobs", {}).items():
            knobs[str(key)] = _knob(f"{there}.knobs.{key}", str(key), laws, knob)
    return Controller(
        name, found["title"], laws["position_controller"], laws["attitude_controller"], fixed, (*knobs.values(),)
    )


def _knob(place: str, name: str, laws: Mapping[str, str], body: Any) -> Knob:
    found = _section(body, place, _KNOB, _BOUNDS)
    node = found["node"]
    if node not in laws:
        raise ParameterError(f"{place}.node: found {node!r}, expected one of {', '.join(laws)}")
    low, high = found.get("low", math.nan), found.get("high", math.nan)
    names = tuple(_full_name(laws[node], key) for key in found["parameters"])
    return _bounded(place, Knob(name, node, names, low, high, found.get("log", False)), laws[node])


def _full_name(law: str, key: str) -> str:
    """Return the parameter's name in its node: of the law, but for those of the prediction before it."""
    return key if key.startswith("prediction.") else f"{law}.{key}"


@cache
def _specs(node: str, law: str) -> Mapping[str, Any]:
    return {field.name: field.spec for field in resolve(node, {"law": law}).all_fields()}


def _spec(place: str, node: str, law: str, name: str) -> Any:
    """Return what a parameter of a node with this law may be. Raises ParameterError, with the place, if it has none."""
    known = _specs(node, law)
    if name not in known:
        raise ParameterError(f"{place}: found {name}, which law {law} does not have{nearest(name, list(known))}")
    return known[name]


def _bounded(place: str, knob: Knob, law: str) -> Knob:
    """Return ``knob`` with bounds that are not given taken from its parameters; they must lie within theirs."""
    for name in knob.parameters:
        spec = _spec(place, knob.node, law, name)
        if not isinstance(spec, Real):
            raise ParameterError(f"{place}: found {name}, expected a real parameter of {knob.node}")
        low = spec.low if knob.low != knob.low else knob.low
        high = spec.high if knob.high != knob.high else knob.high
        if not spec.low <= low < high <= spec.high:
            raise ParameterError(f"{place}: found [{low}, {high}], expected within [{spec.low}, {spec.high}] of {name}")
        if knob.log and low <= 0.0:
            raise ParameterError(f"{place}: found low {low}, expected more than 0 for log: true")
        knob = knob._replace(low=low, high=high)
    return knob


def _check(plan: StudyPlan) -> None:
    late = [seed for seed in plan.tuning.seeds if seed >= plan.study.held_out_first]
    if late:
        raise ParameterError(f"tuning.seeds: found {late[0]}, expected less than study.held_out_first")
    for controller in plan.controllers:
        for case in {*plan.tuning.cases, *plan.study.cases}:
            for plant in {*plan.tuning.plants, *plan.study.plants}:
                for condition in plan.tuning.conditions + plan.study.conditions:
                    flight_of(controller.overrides({}), case, plant, plan.study.start, condition.overrides)

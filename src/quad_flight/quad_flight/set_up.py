"""From what is asked for to the resolved parameters of the five nodes, checked before a process starts."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from quad_core import plugins
from quad_core.cascade import ALL_ROLES, COMMANDER, RELAY, ROLES, SHADOW, SIMULATOR, STAGES, VEHICLE_INTERFACES
from quad_core.parameter_files import check_reached, dump_yaml, overrides_for, place_of, read_parameter_file
from quad_core.parameters import ParameterError, Value, build, fields, flatten
from quad_core.plugins import PluginError
from quad_core.resolution import Resolved, check_agreement, parse_settings, resolve, with_law
from quad_core.types import CALM, Vec3, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics import timeline
from quad_dynamics.ground import SINK
from quad_guard.ending import stands

SHIPPED = Path(__file__).parent / "config"  # in the package, so that no ament index is needed
_FEW = 3  # changed numbers that a line still names
VEHICLES, CONTROLLERS, SCENARIOS, LIMITS = "vehicles", "controllers", "scenarios", "limits"
Overrides = dict[str, dict[str, Value]]
_WINDS, _WIND, _FELT = {"wind", "gust", "dryden"}, 10.0, 0.05  # kinds of events; m/s; m/s^2


class Request(NamedTuple):
    """What a flight is asked to be, as by the options of ``scripts/fly``; None leaves it to files and defaults."""

    case: str
    preset: str = "tuned"
    vehicle: str = "paper"
    plant: str | None = None
    start: str | None = None
    position: str | None = None
    attitude: str | None = None
    seed: int | None = None
    duration: float | None = None
    realtime: bool = False
    settings: Sequence[str] = ()
    relay: bool = False
    shadows: Sequence[str] = ()
    scenario: str | None = None
    mission: str | None = None
    trajectory: str | None = None
    namespace: str = "/"


class Asked(NamedTuple):
    """What is asked for, read and not yet resolved.

    ``files``: later ones win. ``values``, ``settings`` and ``identity``: {role or "/**": {name: value}}, of which
    each wins over the one before, and over the files.
    """

    files: list[Path]
    roles: tuple[str, ...]
    shadows: Mapping[str, str]
    values: Mapping[str, Mapping[str, Value]]
    settings: Mapping[str, Mapping[str, Value]]
    identity: Mapping[str, Mapping[str, Value]]
    namespace: str

    def resolve(self, role: str, defaults: Mapping[str, Value], forced: Any = None) -> Resolved:
        """Return the parameters of a node; ``defaults`` count where nothing is asked for.

        ``forced``: a function from (resolved, values) to the values that win over all that is asked for. Raises
        ParameterError or PluginError naming the node and the file.
        """
        like, (read, _) = role.removeprefix(SHADOW), self.read(role)
        values = {**defaults, **read}
        for asked in (self.values.get("/**", {}), self.values.get(like, {})):
            values.update(asked)
        try:
            if role in self.shadows:
                values = with_law({"law": ROLES[like].parameters().law, **values}, self.shadows[role])
            for layer in (self.settings, self.identity):
                values = {**values, **layer.get("/**", {}), **layer.get(role, {})}
            found = resolve(role, values)
            return resolve(role, {**values, **forced(found, values)}) if forced else found
        except (ParameterError, PluginError) as error:
            place = _line_of(self.files, error) or place_of(str(error), self.files, like)
            kind = PluginError if isinstance(error, PluginError) else ParameterError
            raise kind(f"{role}: {place}{error}") from error

    def read(self, role: str) -> tuple[dict[str, Value], list[str]]:
        """Return the parameters in the files that a node gets, and the names of those that are left out.

        Left out are those of a plug-in that the files choose and what is asked for does not. A law's are not among
        them: they are gains, and without them another law flies with those of another vehicle.
        """
        like = role.removeprefix(SHADOW)
        read, kind = _read(self.files, like, self.namespace), ALL_ROLES[like]
        flown = {**read, **self.values.get(like, {}), **self.settings.get(role, {})}
        before = {slot: read.get(slot, getattr(kind.parameters(), slot)) for slot in kind.slots if slot != "law"}
        others = tuple(f"{name}." for slot, name in before.items() if name != flown.get(slot, name))
        unused = sorted(name for name in read if name.startswith(others))
        return {name: value for name, value in read.items() if name not in unused}, unused


def resolve_flight(request: Request, identity: Mapping[str, Mapping[str, Value]]) -> dict[str, Resolved]:
    """Return {role: all parameters of its node} of a flight.

    Three steps: what is asked for is read, the vehicle is resolved, then the other nodes, whose defaults follow from
    it. ``identity`` ({role or "/**": {name: value}}) holds what belongs to this one run (run id, directory) and wins.
    Raises ParameterError or PluginError naming the file or key, what was found and what was expected.
    """
    asked = read_request(request, identity)
    vehicle = asked.resolve(SIMULATOR, {}, _on_the_ground if request.mission is not None else None)
    defaults = following(request, vehicle)
    others = {role: asked.resolve(role, defaults.get(role.removeprefix(SHADOW), {})) for role in asked.roles[1:]}
    resolved = {SIMULATOR: vehicle, **others}
    check_agreement(resolved)
    _check_whole(resolved)
    return resolved


def read_request(request: Request, identity: Mapping[str, Mapping[str, Value]]) -> Asked:
    """Return what ``request`` asks for; raises ParameterError for an unknown name, or a key that reaches no node."""
    files = [shipped_file(VEHICLES, request.vehicle)]
    files.append(shipped_file(CONTROLLERS, request.preset))
    trajectory, shipped = request.case, shipped_names(SCENARIOS)
    if request.case not in (*shipped, *plugins.names(plugins.TRAJECTORY)):
        known = sorted({*shipped, *plugins.names(plugins.TRAJECTORY)})
        raise ParameterError(f"case: found {request.case!r}, expected one of {', '.join(known)}")
    for scenario in (request.case if request.case in shipped else None, request.scenario):
        if scenario is not None:
            files.append(shipped_file(SCENARIOS, scenario))
            trajectory = str(_read([files[-1]], "trajectory", request.namespace).get("trajectory", trajectory))
    shadows = shadow_laws(request.shadows)
    optional = [role for role, there in ((RELAY, request.relay), (COMMANDER, request.mission is not None)) if there]
    roles = (SIMULATOR, *(role for role in ROLES if role != SIMULATOR), *optional, *shadows)
    values = _chosen(request, request.trajectory or trajectory, roles)
    settings = parse_settings(request.settings, roles)
    for path in files:  # a vehicle's file may say what a bridge to it needs
        check_reached(path, (*roles, *(VEHICLE_INTERFACES if path == files[0] else ())), request.namespace)
    return Asked(files, roles, shadows, values, settings, identity, request.namespace)


def left_out(request: Request) -> str:
    """Return what to say of parameters in the files that belong to what is not flown, empty without any."""
    asked = read_request(request, {})
    names = [f"{role}.{name}" for role in asked.roles for name in asked.read(role)[1]]
    return f"not flown, so left out: {', '.join(names)}" if names else ""


def following(request: Request, vehicle: Resolved) -> dict[str, dict[str, Value]]:
    """Return {role: defaults} that follow from a vehicle: laws predict what is old, a relay knows where it stands."""
    found: dict[str, dict[str, Value]] = {}
    if request.relay or is_late(vehicle.plugins["sensing"].parameters):
        found = {stage.role: {"prediction.enabled": True} for stage in STAGES}
    if request.relay:
        found[RELAY] = {"on_ground": stands(vehicle.plugins["plant"].parameters)}
    return found


def is_late(sensing: Any) -> bool:
    """Return whether sensors with these parameters say that what they show is old."""
    return any(field.name.endswith("delay") and float(field.default) > 0.0 for field in fields(sensing))


def _on_the_ground(simulator: Resolved, values: Mapping[str, Value]) -> dict[str, Value]:
    """Return the plant's parameters with which the vehicle stands on a ground at step 0."""
    plant = simulator.plugins["plant"]
    ground, start = plant.parameters.ground, plant.parameters.initial.p.z
    try:
        plant.module.init(plant.parameters._replace(ground=ground._replace(enabled=True)), simulator.vehicle)
    except ValueError as error:
        raise ParameterError(f"--mission: takes off and lands, but {error}") from error
    above = ground.foot_depth - SINK
    if values.get(f"{plant.name}.ground.enabled"):
        start = ground.height + above
        return {f"{plant.name}.initial.p.z": start, "guard.ground_height": start}
    ground_below = {f"{plant.name}.ground.enabled": True, f"{plant.name}.ground.height": start - above}
    return {**ground_below, "guard.ground_height": start}


def shadow_laws(laws: Sequence[str]) -> dict[str, str]:
    """Return {role of the shadow: law} of LAW, or position=LAW and attitude=LAW where both kinds have one.

    Raises ParameterError for an unknown law, one of both kinds, or a second shadow of one kind.
    """
    kinds = {"position": plugins.POSITION_LAW, "attitude": plugins.ATTITUDE_LAW}
    found: dict[str, str] = {}
    for text in laws:
        kind, equals, law = text.partition("=")
        law = law if equals else text
        fitting = [
            name for name, group in kinds.items() if law in plugins.names(group) and (not equals or name == kind)
        ]
        if len(fitting) != 1:
            known = " or ".join(f"{name}={{{','.join(plugins.names(group))}}}" for name, group in kinds.items())
            raise ParameterError(f"--shadow: found {text!r}, expected {known}")
        role = f"{SHADOW}{fitting[0]}_controller"
        if role in found:
            raise ParameterError(f"--shadow: found {found[role]!r} and {law!r}, expected one {fitting[0]} law")
        found[role] = law
    return found


def _line_of(files: Sequence[Path], error: Exception) -> str:
    """Return ``FILE:LINE: `` of the line of a scenario that ``error`` (its ``text``) is about, empty for any other."""
    text = getattr(error, "text", None)
    for path in reversed(files):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            if text is not None and line.partition("#")[0].strip() == text:
                return f"{path}:{number}: "
    return ""


def parameter_file(resolved: Mapping[str, Resolved], namespace: str = "", interfaces: Sequence[str] = ()) -> str:
    """Return the flight as one ROS 2 parameter file: every parameter of every node in ``namespace``, as resolved.

    ``interfaces``: nodes that may take the simulator's role; they get what all nodes share.
    """
    prefix = "/" + namespace.strip("/") if namespace.strip("/") else ""
    content = {
        f"{prefix}/{role}": {"ros__parameters": {field.name: field.default for field in node.all_fields()}}
        for role, node in resolved.items()
    }
    for interface in interfaces:
        every = content[f"{prefix}/{SIMULATOR}"]["ros__parameters"]
        shared = {name: value for name, value in every.items() if name.startswith(("flight.", "vehicle."))}
        content[f"{prefix}/{interface}"] = {"ros__parameters": shared}
    return dump_yaml(content)


def _read(files: Sequence[Path], role: str, namespace: str) -> dict[str, Value]:
    return overrides_for([read_parameter_file(path) for path in files], role, namespace)


def _chosen(request: Request, trajectory: str, roles: Sequence[str]) -> dict[str, dict[str, Value]]:
    choices: list[tuple[str, str, Value | None]] = [
        ("/**", "flight.mode", "realtime" if request.realtime else None),
        ("/**", "flight.seed", request.seed),
        ("/**", "flight.roles", ",".join(roles) if len(roles) > len(ROLES) else None),
        ("simulator", "plant", request.plant),
        (COMMANDER, "mission", request.mission),
        ("simulator", "publish_state", False if request.relay else None),
        ("simulator", "odom_period_steps", 1 if request.relay else None),
        ("trajectory", "trajectory", trajectory),
        ("trajectory", f"{trajectory}.start", request.start),
        ("trajectory", f"{trajectory}.duration", request.duration),
        ("position_controller", "law", request.position),
        ("attitude_controller", "law", request.attitude),
    ]
    asked: Overrides = {}
    for role, name, value in choices:
        if value is not None:
            asked.setdefault(role, {})[name] = value
    return asked


def _check_whole(resolved: Mapping[str, Resolved]) -> None:
    """Refuse what is good for each node and bad for the flight."""
    roles = set(resolved[SIMULATOR].flight.role_names)
    if roles != set(resolved):
        raise ParameterError(f"flight.roles: found {', '.join(sorted(roles))}, expected all of {', '.join(resolved)}")
    window, every = resolved["simulator"].node.window, resolved["recorder"].node.ack_steps
    if every >= window:
        raise ParameterError(f"recorder.ack_steps: found {every}, expected less than simulator.window, {window}")


def vehicle_text(request: Request, vehicle: Vehicle) -> str:
    """Return the name of a request's vehicle, and which numbers a scenario or a setting has changed."""
    path = shipped_file(VEHICLES, request.vehicle)
    values = overrides_for([read_parameter_file(path)], SIMULATOR, request.namespace)
    own = {name.removeprefix("vehicle."): value for name, value in values.items() if name.startswith("vehicle.")}
    was, now = flatten(build(Vehicle, own, "vehicle.")), flatten(vehicle)
    changed = [f"{name}={value}" for name, value in now.items() if value != was[name]]
    about = ", ".join(changed) if len(changed) <= _FEW else f"{len(changed)} of its numbers are set elsewhere"
    return f"{request.vehicle} ({about})" if changed else str(request.vehicle)


def unfelt_wind(resolved: Mapping[str, Resolved]) -> str:
    """Return what to say of a scenario's wind that the vehicle does not feel, empty if it does or without wind."""
    plugins_, vehicle = resolved[SIMULATOR].plugins, resolved[SIMULATOR].vehicle
    events = getattr(plugins_["disturbance"].parameters, "events", "")
    if plugins_["disturbance"].module is not timeline or not _WINDS & {event.kind for event in timeline.parsed(events)}:
        return ""
    plant, hover = plugins_["plant"], Wrench(vehicle.mass * vehicle.gravity, Vec3())
    calm, windy = (
        plant.module.lumped(
            plant.parameters, vehicle, plant.module.init(plant.parameters, vehicle), hover, CALM._replace(wind_w=wind)
        ).lumped_acceleration_w
        for wind in (Vec3(), Vec3(_WIND, 0.0, 0.0))
    )
    push = windy.x - calm.x
    drag = f"drag coefficient {vehicle.drag_coefficient:g} N s/m"
    felt = f"a wind of {_WIND:g} m/s pushes this vehicle by {push:.2g} m/s^2 alone ({drag}): --vehicle x500 feels it"
    return felt if abs(push) < _FELT else ""


def summary(resolved: Mapping[str, Resolved]) -> dict[str, Any]:
    """Return what names a flight for people: trajectory, start, laws, plant, mode, seed."""
    trajectory = resolved["trajectory"].plugins["trajectory"]
    return {
        "trajectory": trajectory.name,
        "start": flatten(trajectory.parameters).get("start", "approach"),
        "position": resolved["position_controller"].node.law,
        "attitude": resolved["attitude_controller"].node.law,
        "plant": resolved["simulator"].node.plant,
        "mode": flatten(resolved["simulator"].flight)["mode"],
        "seed": resolved["simulator"].flight.seed,
    }


def shipped_names(kind: str) -> list[str]:
    """Return the sorted names of the files of one kind that come with the stack."""
    return sorted(path.stem for path in (SHIPPED / kind).glob("*.yaml"))


def shipped_file(kind: str, name: str | Path) -> Path:
    """Return the file that ``name`` stands for: one that comes with the stack, or the path of a YAML file.

    Raises ParameterError if there is no such file.
    """
    names = shipped_names(kind)
    if str(name) in names:
        return SHIPPED / kind / f"{name}.yaml"
    if str(name).endswith((".yaml", ".yml")) and Path(name).is_file():
        return Path(name)
    raise ParameterError(f"{kind}: found {str(name)!r}, expected {', '.join(names)} or the path of a YAML file")

"""The same flight with other numbers: which parameters may vary between the flights of a campaign, and how."""

from collections.abc import Iterable, Mapping
from operator import attrgetter
from typing import Any, NamedTuple

from quad_core.cascade import ROLES, SIMULATOR, STAGES, TRAJECTORY
from quad_core.parameters import Choice, Field, ParameterError, Value, checked, fields
from quad_core.vehicle import check_inertia
from quad_flight.flight import Flight

SEED = "flight.seed"
_PARTS = {
    **{(role, slot): (slot,) for role in (SIMULATOR, TRAJECTORY) for slot in ROLES[role].slots},
    **{(stage.role, "law"): ("stages", stage.role) for stage in STAGES},
}
"""{(role, slot of a plug-in): where in ``Setup`` its parameters stand}."""


class _Place(NamedTuple):
    """Where in ``Setup`` a parameter stands (empty: the seed), and what it admits."""

    path: tuple[str, ...]
    field: Field


class Variation:
    """Puts values of named parameters into a flight without resolving everything again.

    Names are those of ``scripts/fly --set``: ``vehicle.*``, ``flight.seed``, or the node, the plug-in and the
    parameter (``simulator.rigid_body.mass_error``). What decides which code runs cannot vary.
    """

    def __init__(self, base: Flight, names: Iterable[str]) -> None:
        """Look the names up; raises ParameterError naming one that the flight has not, and what it has."""
        self._base = base
        known = _places(base)
        self._places: dict[str, _Place] = {}
        for name in names:
            if name not in known:
                family = name.rpartition(".")[0]
                near = [other for other in known if other.startswith(family.split(".")[0])] or list(known)
                raise ParameterError(f"{name}: found no such parameter to vary, expected one of {', '.join(near)}")
            self._places[name] = known[name]
        self._checks = [
            (module.check, attrgetter(".".join(_path(base, role, slot))))
            for role, slot in _PARTS
            if hasattr(module := base.resolved[role].plugins[slot].module, "check")
        ]

    def field(self, name: str) -> Field:
        """Return what parameter ``name`` admits, and its value in the base flight."""
        return self._places[name].field

    def apply(self, values: Mapping[str, Value]) -> Flight:
        """Return the base flight with ``values``; raises ParameterError for one that is not admitted."""
        setup, seed = self._base.setup, self._base.seed
        for name, value in values.items():
            path, field = self._places[name]
            good: Any = checked(field._replace(name=name), value)
            if isinstance(field.spec, Choice):
                good = field.spec.options.index(good)
            if path:
                setup = _replaced(setup, path, good)
            else:
                seed = good
        check_inertia(setup.vehicle)
        for check, parameters_of in self._checks:
            check(parameters_of(setup))
        return self._base._replace(setup=setup, seed=seed)


def _path(base: Flight, role: str, slot: str) -> tuple[str, ...]:
    """Return where in ``Setup`` the parameters of a plug-in stand: one level deeper for a law that is wrapped."""
    resolved, part = base.resolved[role], _PARTS[role, slot]
    is_wrapped = slot == "law" and resolved.law.parameters is not resolved.plugins[slot].parameters
    return (*part, "law") if is_wrapped else part


def _places(base: Flight) -> dict[str, _Place]:
    simulator = base.resolved[SIMULATOR]
    found = {SEED: _Place((), next(field for field in fields(simulator.flight) if field.name == "seed"))}
    for field in fields(simulator.vehicle):
        found[f"vehicle.{field.name}"] = _Place(("vehicle", *field.name.split(".")), field)
    for (role, slot), part in _PARTS.items():
        plugin, own = base.resolved[role].plugins[slot], _path(base, role, slot)
        if own != part:
            for name in base.resolved[role].law.module.Parameters._fields[1:]:
                for field in fields(getattr(base.resolved[role].node, name), f"{name}."):
                    if field.name == f"{name}.enabled":  # whether the law is wrapped at all
                        continue
                    found[f"{role}.{field.name}"] = _Place((*part, *field.name.split(".")), field)
        for field in fields(plugin.parameters):
            found[f"{role}.{plugin.name}.{field.name}"] = _Place((*own, *field.name.split(".")), field)
    return found


def _replaced(whole: Any, path: tuple[str, ...], value: Any) -> Any:
    name, *rest = path
    return whole._replace(**{name: _replaced(getattr(whole, name), tuple(rest), value) if rest else value})

"""A ROS domain of its own for each flight, so that flights at the same time do not meet."""

import os
import random
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from domain_coordinator import domain_id

from quad_core.parameters import ParameterError
from quad_node.middleware import DOMAIN, checked_domain

# Above 101 the ports of the default transport may collide with ephemeral ones; 0 is the default of all other nodes.
DOMAINS = range(1, 102)
_FIRST_PORT, _PORTS_EACH = 7400, 250
_UDP_SOCKETS = Path("/proc/net/udp")


@contextmanager
def reserved_domain(requested: int | None) -> Iterator[int]:
    """Hold a domain for the time of a flight; flights of every user of this machine avoid it.

    ``requested``, else ROS_DOMAIN_ID where it is set: exactly this one, which other flights may want too (namespaces
    tell them apart). Raises ParameterError if no domain is free.
    """
    for name, chosen in (("--domain", requested), (DOMAIN, os.environ.get(DOMAIN) or None)):
        if chosen is not None:
            yield checked_domain(name, chosen)
            return
    reservation = domain_id(iter(_candidates()).__next__)
    try:
        domain = reservation.__enter__()
    except RuntimeError as error:
        raise ParameterError("--domain: found every domain reserved by another flight, expected a free one") from error
    try:
        yield domain
    finally:  # it would take an OSError of the flight for a domain that is not free
        reservation.__exit__(None, None, None)


def _candidates() -> list[int]:
    # In random order: the graph of a domain shows a killed node for some 20 s. Domains that others use come last.
    order = random.SystemRandom().sample(DOMAINS, len(DOMAINS))
    return sorted(order, key=occupied().__contains__)


def occupied() -> set[int]:
    """Return the domains in which a process of this machine has a UDP port, by the numbers of DDSI-RTPS 2.2, 9.6.1.1.

    Shared memory is not looked at: nodes of a flight do not use it.
    """
    try:
        lines = _UDP_SOCKETS.read_text().splitlines()[1:]
    except OSError:  # a system without it
        return set()
    found = (int(line.split()[1].rpartition(":")[2], 16) for line in lines)
    return {(port - _FIRST_PORT) // _PORTS_EACH for port in found if port >= _FIRST_PORT}

"""The ports by which Fast DDS finds a domain's processes: those of UDP, and the numbers of its queues in memory.

Source: DDSI-RTPS 2.2, 9.6.1.1, with its default values.
"""

_FIRST, _EACH = 7400, 250


def of_domain(domain: int) -> range:
    """Return the ports of ``domain``."""
    first = _FIRST + _EACH * domain
    return range(first, first + _EACH)


def domain_of(port: int) -> int | None:
    """Return the domain that ``port`` belongs to, None of one below all domains."""
    return (port - _FIRST) // _EACH if port >= _FIRST else None

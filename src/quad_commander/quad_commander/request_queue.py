"""Requests that wait for the commander's next step: bounded, the most severe first.

queue = RequestQueue()
queue.add(PendingRequest(Request.HOLD, "operator"))      # whenever a message or a service call comes
queue.age(dt)                                   # at each step
asked = queue.take(mode)                        # one request, or None
queue.grant(asked, mode)                        # if it was done
"""

from typing import NamedTuple

from quad_commander.mode_table import GRANTED, severity
from quad_commander.references import Place
from quad_core.enumerations import Mode, Request

MOST_SENDERS = 16
REPEATS_WITHIN = 0.5
"""Seconds within which a sender that asks again for what it was granted only repeats itself."""

_RANKS = {Request.KILL: 4, Request.DESCEND: 3, Request.LAND: 2, Request.HOLD: 1}


class PendingRequest(NamedTuple):
    """A request and its sender.

    ``overtaken``: the more severe mode that began meanwhile, if any; ``place``: where GOTO is to lead.
    """

    request: Request
    sender: str
    overtaken: str = ""
    place: Place | None = None


class RequestQueue:
    """The newest request of each sender; a milder one does not replace a more severe one of the same step.

    Requests of equal rank are taken in the order of arrival. A granted request overtakes all milder ones that wait,
    and one that its sender keeps repeating never leads back to a less severe mode: no HOLD that was asked for before a
    LAND undoes it.
    """

    def __init__(self) -> None:
        self._waiting: dict[str, PendingRequest] = {}
        self._granted: dict[tuple[str, Request], float] = {}  # s since it was asked for last

    def add(self, asked: PendingRequest) -> bool:
        """Take in a request; returns False if the queue is full.

        A milder one than its sender's own that waits is dropped.
        """
        key = (asked.sender, asked.request)
        if key in self._granted:
            self._granted[key] = 0.0
        before = self._waiting.get(asked.sender)
        if before is not None and _rank(before) > _rank(asked):
            return True
        if before is None and len(self._waiting) >= MOST_SENDERS:
            mildest = min(self._waiting.values(), key=_rank)
            if _rank(mildest) >= _rank(asked):
                return False
            del self._waiting[mildest.sender]
        self._waiting.pop(asked.sender, None)  # it comes after the others of its rank
        self._waiting[asked.sender] = asked
        return True

    def age(self, dt: float) -> None:
        """Let ``dt`` s pass."""
        self._granted = {key: age + dt for key, age in self._granted.items() if age + dt <= REPEATS_WITHIN}

    def take(self, mode: Mode) -> PendingRequest | None:
        """Return the most severe request and forget it."""
        while self._waiting:
            asked = self._waiting.pop(max(self._waiting.values(), key=_rank).sender)
            if not self.only_repeats(asked, mode):
                return asked
        return None

    def only_repeats(self, asked: PendingRequest, mode: Mode) -> bool:
        """Return whether ``asked`` repeats what its sender was granted, and would lead back from ``mode`` or arm."""
        then = GRANTED[asked.request].get(mode)
        leads_back = then is None or severity(then) < severity(mode) or (then == Mode.ARMING and mode != then)
        return leads_back and (asked.sender, asked.request) in self._granted

    def ahead_of(self, request: Request) -> list[PendingRequest]:
        """Return what waits and overtakes ``request`` if it is granted."""
        rank = _RANKS.get(request, 0)
        return [asked for asked in self._waiting.values() if _rank(asked) > rank]

    def grant(self, asked: PendingRequest, mode: Mode) -> None:
        """Remember that a request was done and led to ``mode``; it overtakes what is milder."""
        self._granted[asked.sender, asked.request] = 0.0
        self._overtake(_rank(asked), mode)

    def begin(self, mode: Mode) -> None:
        """Note that ``mode`` began unasked; it overtakes the requests for milder ones."""
        led = (rank for request, rank in _RANKS.items() if severity(GRANTED[request][Mode.HOLD]) <= severity(mode))
        self._overtake(max(led, default=0), mode)

    def _overtake(self, rank: int, mode: Mode) -> None:
        self._waiting = {
            sender: asked._replace(overtaken=mode.name) if _rank(asked) < rank else asked
            for sender, asked in self._waiting.items()
        }


def _rank(asked: PendingRequest) -> int:
    return _RANKS.get(asked.request, 0)

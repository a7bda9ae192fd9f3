"""The message of ``flight/mode`` as CDR; what has not changed since the last step is not written again."""

import struct

from rclpy.serialization import serialize_message

from quad_commander.conduct import Said
from quad_commander.mode_table import Mode
from quad_msgs.msg import FlightMode
from quad_node.codec import HEADER
from quad_node.conversion import NANOSECONDS

_HEAD = struct.Struct("<4siIQQ")


class ModePayload:
    """Writes what the commander said."""

    def __init__(self, run_id: str) -> None:
        """Write for a run."""
        self._run_id = run_id
        self._content: tuple[object, ...] = ()
        self._tail = b""

    def of(self, said: Said, step: int, next_step: int, stamp: int) -> bytes:
        """Return the payload of one step; ``stamp`` in ns."""
        content = (said.mode, said.text, said.sender, said.answer_text, said.outcome)
        if content != self._content:
            message = FlightMode(
                **said.mode._asdict(),
                name=Mode(said.mode.mode).name,
                text=said.text,
                sender=said.sender,
                answer_text=said.answer_text,
                outcome=said.outcome,
                run_id=self._run_id,
            )
            self._tail, self._content = serialize_message(message)[_HEAD.size :], content
        return _HEAD.pack(HEADER, *divmod(stamp, NANOSECONDS), step, next_step) + self._tail

"""Ask a flight's commander for something: `ros2 run quad_commander command land`, or `... command goto 4 0 2 90deg`.

Prints the answer with its reason. Exit codes: 0 done, 1 refused, 2 no answer or bad usage.
"""

import math
import re
import secrets
import sys
import time
from collections.abc import Callable, Sequence

import rclpy
from rclpy.exceptions import InvalidNamespaceException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from quad_commander.missions import read_place
from quad_commander.references import Place
from quad_commander.services import SERVICES, sender_of
from quad_core.command_line import Parser, open_streams
from quad_core.enumerations import Request
from quad_core.parameters import ParameterError
from quad_msgs.msg import FlightMode
from quad_node import executor, topics
from quad_node.middleware import close_unless_asked

DONE, REFUSED, NO_ANSWER = 0, 1, 2
WORDS = {request.name.lower(): request for request in SERVICES}
_HUNG = NO_ANSWER


def ask(request: Request, namespace: str, patience: float, place: Place | None = None) -> tuple[int, str]:
    """Return the exit code and the line to print of asking the flight in ``namespace``, waiting ``patience`` s."""
    deadline, name = time.monotonic() + patience, request.name.lower()
    node = Node(
        f"command_{secrets.token_hex(4)}", namespace=namespace, enable_rosout=False, start_parameter_services=False
    )
    said: list[FlightMode] = []
    entry = topics.TOPICS["flight/mode"]
    node.create_subscription(entry.type, entry.name, said.append, topics.latched())
    kind = SERVICES[request]
    service, call = node.create_client(kind, name), kind.Request()
    if place is not None:
        call.p_w, call.yaw = [place.x, place.y, place.z], math.nan if place.yaw is None else place.yaw

    def spin(until: Callable[[], object]) -> bool:
        while not until() and time.monotonic() < deadline:
            rclpy.spin_once(node, timeout_sec=0.05)
        return bool(until())

    try:
        where = f"in namespace {namespace!r}" if namespace else "without a namespace"
        # its newest mode tells an answer of before from that to this call
        if not spin(lambda: service.service_is_ready() and (said or not node.count_publishers("flight/mode"))):
            return NO_ANSWER, f"{name}: found no commander {where} within {patience:g} s, expected one"
        before = said[-1].request_step if said else -1
        answered = service.call_async(call)
        if not spin(answered.done):
            return NO_ANSWER, f"{name}: found no answer within {patience:g} s, expected one"
        answer = answered.result()
        is_decided = (
            answer.success and request != Request.END and spin(lambda: said and _is_ours(said[-1], request, before))
        )
    finally:
        executor.destroy(node, _HUNG)
    mode = said[-1] if said else FlightMode()
    if not answer.success or (is_decided and mode.answer == FlightMode.REFUSED):
        return REFUSED, f"refused: {mode.answer_text if answer.success else answer.message}; the mode is {mode.name}"
    if request == Request.END:
        return DONE, f"done: {answer.message}"
    if not is_decided:
        return NO_ANSWER, f"flight/mode: found no answer within {patience:g} s, expected one"
    more = f"; waits for: {mode.answer_text}" if mode.answer_text else ""
    return DONE, f"done at step {mode.request_step}: the mode is {mode.name}{more}"


def _is_ours(mode: FlightMode, request: Request, before: int) -> bool:
    """Return whether ``mode`` answers a call of the service of ``request`` after the request of step ``before``."""
    is_it = mode.sender == sender_of(request) and mode.request == request
    return bool(is_it and mode.request_step != before)


def main(arguments: Sequence[str] | None = None) -> None:
    """Ask what the command line says."""
    open_streams()
    parser = Parser(prog="command", description=__doc__)
    parser.add_argument("request", choices=list(WORDS), metavar="REQUEST", help=", ".join(WORDS))
    where = "of goto: x y z in m, world frame; yaw in rad or as 90deg, without it the heading stays"
    parser.add_argument("place", nargs="*", metavar="PLACE", help=where)
    parser.add_argument("--namespace", default="", metavar="NAME", help="namespace of the vehicle")
    parser.add_argument("--patience", type=float, default=10.0, metavar="S", help="how long to wait (default: 10)")
    given = sys.argv[1:] if arguments is None else arguments
    # argparse takes -90deg and -1e1 for options
    options = parser.parse_args([re.sub(r"^-(?=[\d.])", " -", word) for word in given])
    place = None
    if options.request == "goto":
        try:
            place = read_place([word.strip() for word in options.place], f"goto: found {' '.join(options.place)!r}")
        except ParameterError as error:
            parser.error(str(error))
    elif options.place:
        parser.error(f"{options.request}: found {' '.join(options.place)!r}, expected nothing after it")
    try:
        close_unless_asked()
        rclpy.init(args=[])
        code, line = ask(WORDS[options.request], options.namespace.strip("/"), options.patience, place)
    except ParameterError as error:
        code, line = NO_ANSWER, str(error)
    except InvalidNamespaceException as error:
        code, line = NO_ANSWER, f"--namespace: {str(error).splitlines()[0]}"
    except (KeyboardInterrupt, ExternalShutdownException):
        code, line = NO_ANSWER, "interrupted before the answer"
    finally:
        rclpy.try_shutdown()
    print(f"command: {options.request}: {line}", file=sys.stdout if code == DONE else sys.stderr)
    sys.exit(code)

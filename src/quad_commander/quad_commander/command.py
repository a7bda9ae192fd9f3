"""Ask a flight's commander for something: `ros2 run quad_commander command land`, or `... command goto 4 0 2 90deg`.

Prints the answer with its reason. Exit codes: 0 done, 1 refused, 2 no answer or bad usage.
"""

import argparse
import math
import re
import secrets
import sys
import time
from collections.abc import Callable, Sequence

import rclpy
from rclpy.duration import Duration
from rclpy.exceptions import InvalidNamespaceException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from quad_commander.missions import read_place
from quad_commander.mode_table import GRANTED
from quad_commander.references import Place
from quad_core.command_line import Parser, open_streams
from quad_core.enumerations import Request
from quad_core.parameters import ParameterError
from quad_msgs.msg import FlightMode, FlightRequest
from quad_node import executor, topics
from quad_node.middleware import close_unless_asked

DONE, REFUSED, NO_ANSWER = 0, 1, 2
WORDS = {request.name.lower(): request for request in sorted(GRANTED)}
_HUNG = NO_ANSWER
_FOR_RECORDER = 0.5  # s for a recorder to be found, and to have the request


def ask(request: Request, namespace: str, patience: float, place: Place | None = None) -> tuple[int, str]:
    """Return the exit code and the line to print of asking the flight in ``namespace``, waiting ``patience`` s."""
    deadline = time.monotonic() + patience
    name = f"command_{secrets.token_hex(4)}"
    node = Node(name, namespace=namespace, enable_rosout=False, start_parameter_services=False)
    message = FlightRequest(request=int(request), sender=name)
    if place is not None:
        message.p_w, message.yaw = [place.x, place.y, place.z], math.nan if place.yaw is None else place.yaw
    answers: list[FlightMode] = []
    entry = topics.TOPICS["flight/request"]
    requests = node.create_publisher(entry.type, entry.name, entry.qos())
    entry = topics.TOPICS["flight/mode"]
    modes = node.create_subscription(
        entry.type, entry.name, lambda said: answers.append(said) if said.sender == name else None, topics.latched()
    )

    def spin(until: Callable[[], object], limit: float = deadline) -> bool:
        while not until() and time.monotonic() < min(limit, deadline):
            rclpy.spin_once(node, timeout_sec=0.05)
        return bool(until())

    try:
        where = f"in namespace {namespace!r}" if namespace else "without a namespace"
        # a commander that is asked must have its way to answer, too: it repeats its last one
        if not spin(lambda: requests.get_subscription_count() and modes.get_publisher_count()):
            return NO_ANSWER, f"flight/request: found no commander {where} within {patience:g} s, expected one"
        # a recorder found late holds nothing up for long, and KILL not at all
        patient = 0.0 if request == Request.KILL else _FOR_RECORDER
        spin(lambda: requests.get_subscription_count() > 1, time.monotonic() + patient)
        requests.publish(message)
        spin(lambda: answers)
        requests.wait_for_all_acked(Duration(seconds=_FOR_RECORDER))
    finally:
        executor.destroy(node, _HUNG)
    answer = answers[-1] if answers else None
    if answer is None:
        return NO_ANSWER, f"flight/mode: found no answer within {patience:g} s, expected one"
    if answer.answer == FlightMode.REFUSED:
        return REFUSED, f"refused: {answer.answer_text}; the mode is {answer.name}"
    more = f"; waits for: {answer.answer_text}" if answer.answer_text else ""
    return DONE, f"done at step {answer.request_step}: the mode is {answer.name}{more}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Ask what the command line says."""
    open_streams()
    parser = Parser(prog="command", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
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

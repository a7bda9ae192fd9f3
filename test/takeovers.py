"""Flights with standby controllers: how they are started, which process is the active one, and one started again."""

import os
import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flying import children, node_pids, stranger
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

STANDBY = ("--shadow", "position=aibs", "--shadow", "attitude=abfnitsm", "--set", "flight.standby=true")


def words_of(pid):
    """Return the command line of a process."""
    return [word.decode() for word in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")[:-1]]


def run_id_of(flight):
    """Return the run id that `fly` has given to its nodes."""
    files = [word for word in words_of(node_pids(flight.pid)["simulator"]) if word.endswith(".yaml")]
    return re.search(r"flight\.run_id: *\W?([\w-]+)", "".join(Path(name).read_text() for name in files))[1]


def active_pid(fly_pid, role, shadow=False):
    """Return the pid of the controller that flies from the start, or of its shadow, which runs the same program."""
    for pid in children(fly_pid):
        words = words_of(pid)
        if shadow == any(word.startswith("__node:=") for word in words) and any(
            word.endswith(f"/{role}") for word in words
        ):
            return pid
    raise AssertionError(f"no process of {role}")


def environment_of(pid):
    """Return the environment of a process."""
    pairs = (pair.partition(b"=") for pair in Path(f"/proc/{pid}/environ").read_bytes().split(b"\0") if pair)
    return {name.decode(): value.decode() for name, _, value in pairs}


def asked(domain, name):
    """Ask the node ``name`` to take over; returns whether it does, and what it says."""
    with stranger(domain, "operator") as node:
        client = node.create_client(Trigger, f"{name}/take_over")
        assert client.wait_for_service(20.0)
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        answer = client.call_async(Trigger.Request())
        executor.spin_until_future_complete(answer, 10.0)
        return answer.result().success, answer.result().message


def said_in(log, pattern):
    """Return the first group of ``pattern`` in what a node printed, None if it is not there."""
    found = re.search(pattern, log.read_text())
    return found and found[1]


@contextmanager
def killed_and_started_again(pid: int, log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Kill a node and start it again with the same words and environment; what it prints goes to ``log``."""
    words, environment = words_of(pid), environment_of(pid)
    os.kill(pid, signal.SIGKILL)
    with log.open("wb") as output:
        process = subprocess.Popen(words, env=environment, stdout=output, stderr=output, start_new_session=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()

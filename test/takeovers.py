"""Flights with standby controllers: how they are started, and which process is the active one."""

from pathlib import Path

from flying import children

STANDBY = ("--shadow", "position=aibs", "--shadow", "attitude=abfnitsm", "--set", "flight.standby=true")


def active_pid(fly_pid, role):
    """Return the pid of the controller that flies from the start; its shadow runs the same program."""
    for pid in children(fly_pid):
        words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
        shadow = any(word.startswith(b"__node:=") for word in words)
        if not shadow and any(word.endswith(f"/{role}".encode()) for word in words):
            return pid
    raise AssertionError(f"no process of {role}")

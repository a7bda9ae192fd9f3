"""A room of one's own: /tmp and /dev/shm that nobody else uses, of any size. Needs root, for a mount namespace."""

import os
import shlex
import subprocess
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from flying import ROOT

# A checkout that lies in /tmp is there in the room as well.
_FURNISH = """
cd {root} && exec 9<. && cd /
mount -t tmpfs -o size={shm} none /dev/shm && mount -t tmpfs -o size={tmp} none /tmp || exit
test -d {root} || {{ mkdir -p {root} && mount --no-canonicalize --bind /proc/self/fd/9 {root}; }} || exit
echo ready
exec sleep 86400 9<&-
"""
_ROOT_IN_TMP = {part.name for part in (ROOT, *ROOT.parents) if part.parent == Path("/tmp")}
_SYSTEM = "lttng-ust-wait"  # two files that all programs of a machine share, made by a library of ROS 2
LOCKS = f"quad-{os.geteuid()}"  # folder of locks that is kept on purpose


class Room(NamedTuple):
    """A mount namespace that lives as long as process ``keeper``."""

    keeper: int

    def inside(self, *words):
        """Return the command that runs ``words`` in the room, in a process that keeps its pid."""
        return ["nsenter", "-t", str(self.keeper), "-m", f"--wd={Path.cwd()}", *map(str, words)]

    def path(self, inner):
        """Return where a file of the room is seen from outside."""
        return Path(f"/proc/{self.keeper}/root{inner}")

    def left_behind(self, *known):
        """Return the names of what lies in /tmp and /dev/shm, our folder of locks and ``known`` aside."""
        found = [path for inner in ("/tmp", "/dev/shm") for path in self.path(inner).iterdir()]
        names = (path.name for path in found if path.name not in (LOCKS, *_ROOT_IN_TMP, *known))
        return sorted(name for name in names if not name.startswith(_SYSTEM))


@contextmanager
def room(shm="300m", tmp="300m"):
    """Yield a room with file systems of these sizes; PermissionError where it may not be made."""
    if os.geteuid() != 0:
        raise PermissionError("a room of one's own needs root")
    script = _FURNISH.format(root=shlex.quote(str(ROOT)), shm=shm, tmp=tmp)
    command = ["unshare", "-m", "--propagation", "private", "sh", "-c", script]
    keeper = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        if keeper.stdout.readline() != "ready\n":
            raise PermissionError("no file system can be mounted here")
        yield Room(keeper.pid)
    finally:
        keeper.kill()
        keeper.wait()

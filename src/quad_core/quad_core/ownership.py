"""Folders that no other user can change: what lies there is run, so it belongs to this user or root."""

import os
import stat
from pathlib import Path

_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


class NotOursError(PermissionError):
    """A folder that another user owns or can change; the text names it and what was expected."""


def private_folder(path: Path) -> Path:
    """Return the absolute ``path`` of a folder that only we can change; it is made (mode 0700) if it lacks.

    Raises NotOursError if somebody else owns it or can write to it, or can put another one in its place; another
    OSError if it cannot be made.
    """
    path = Path(os.path.realpath(path))
    for parent in reversed(path.parents):
        if parent.exists():
            _check_parent(parent)
    path.mkdir(mode=0o700, parents=True, exist_ok=True)
    status = path.stat()
    if status.st_uid not in _trusted():
        raise NotOursError(f"{path}: found a folder of user {status.st_uid}, expected one of user {os.geteuid()}")
    if status.st_mode & _OTHERS_WRITE:
        mode = stat.S_IMODE(status.st_mode)
        raise NotOursError(f"{path}: found mode {mode:04o}, expected a folder that only its owner writes: chmod go-w")
    return path


def _check_parent(path: Path) -> None:
    """Raise NotOursError if others could rename what lies in ``path``; the sticky bit (as of /tmp) forbids it."""
    status = path.stat()
    open_to_all = status.st_mode & stat.S_IWOTH and not status.st_mode & stat.S_ISVTX
    if status.st_uid not in _trusted() or open_to_all:
        found = f"user {status.st_uid}, mode {stat.S_IMODE(status.st_mode):04o}"
        raise NotOursError(f"{path}: found {found}, expected a folder in which others cannot replace ours")


def _trusted() -> tuple[int, int]:
    return (os.geteuid(), 0)

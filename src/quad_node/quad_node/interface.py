"""What makes two nodes speak the same language: a hash over the type hashes of quad_msgs, and the versions run."""

import hashlib
import json
import platform
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ament_index_python.packages import get_package_share_directory


@cache
def interface_hash() -> str:
    """Return SHA-256 (hex) over name and RIHS01 hash of every message of quad_msgs, sorted by name."""
    digest = hashlib.sha256()
    for path in sorted(Path(get_package_share_directory("quad_msgs"), "msg").glob("*.json")):
        for entry in json.loads(path.read_text(encoding="utf-8"))["type_hashes"]:
            digest.update(f"{entry['type_name']} {entry['hash_string']}\n".encode())
    return digest.hexdigest()


def versions() -> dict[str, str]:
    """Return the versions that decide the bits of a flight."""
    found = {"python": platform.python_version(), "machine": platform.machine(), "libc": " ".join(platform.libc_ver())}
    for name, package in (
        ("quad_stack", "quad_node"),
        ("rclpy", "ros-rclpy"),
        ("rclpy", "rclpy"),
        ("numpy", "numpy"),
        ("mcap", "mcap"),
    ):
        with suppress(PackageNotFoundError):  # rclpy has its own name where it is no wheel
            found.setdefault(name, version(package))
    return found

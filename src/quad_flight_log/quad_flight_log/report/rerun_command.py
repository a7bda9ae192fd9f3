"""How Rerun's viewer is started."""

import sys

_HOST = "127.0.0.1"


def viewer_command(*arguments: str, web: bool, port: int | None = None) -> list[str]:
    """Return the command that starts the viewer of this Python's rerun, listening to this machine only."""
    shown = ["--web-viewer", "--web-viewer-port", "0"] if web else []
    return [sys.executable, "-m", "rerun_cli", "--bind", _HOST, "--port", str(port or "auto"), *shown, *arguments]

"""A real browser without a window, driven through its DevTools protocol, for pages that must work in one."""

import base64
import json
import shutil
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",  # WebGL without a graphics card
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--hide-scrollbars",
    "--remote-debugging-port=0",
)


def browser_path() -> str | None:
    """Return the path of an installed browser, or None."""
    return next((path for path in map(shutil.which, BROWSERS) if path), None)


class Browser:
    """One headless browser with one page. ``problems``: errors of its console; ``requests``: what it loaded."""

    def __init__(
        self, profile: Path, size: tuple[int, int] = (1200, 900), patience: float = 90.0, theme: str = "light"
    ) -> None:
        """Start the browser with an empty profile folder and connect to it."""
        from websockets.sync.client import connect

        path = browser_path()
        assert path is not None, f"no browser: expected one of {', '.join(BROWSERS)}"
        self.patience = patience
        self.problems: list[str] = []
        self.requests: list[str] = []
        self._replies: dict[int, dict[str, Any]] = {}
        self._last = 0
        self._open = ExitStack()
        self._session = ""
        width, height = size
        command = [path, *_FLAGS, f"--user-data-dir={profile}", f"--window-size={width},{height}", "about:blank"]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            self._socket = self._open.enter_context(
                connect(self._address(profile / "DevToolsActivePort"), max_size=None, ping_interval=None)
            )
            target = self._call("Target.createTarget", url="about:blank")["targetId"]
            self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            for domain in ("Page", "Runtime", "Log", "Network"):
                self._call(f"{domain}.enable")
            self.show_as(size, theme)
        except BaseException:
            self._stop()
            raise

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    def show_as(self, size: tuple[int, int], theme: str) -> None:
        """Let pages that are opened from now on have a screen of this size, and a light or dark theme."""
        width, height = size
        self._call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self._call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])

    def open(self, url: str) -> None:
        """Load a page and wait until its scripts have been read."""
        self.value("window.isLeft = true")  # until the new page is there the one before it answers
        self._call("Page.navigate", url=url)
        self.wait("!window.isLeft && document.readyState === 'complete'")

    def value(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, a promise awaited; fails on an exception in it."""
        found = self._call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, f"{expression}: {found['exceptionDetails']}"
        return found["result"].get("value")

    def wait(self, expression: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + self.patience
        while not self.value(expression):
            assert time.monotonic() < end, f"not true after {self.patience} s: {expression}; console: {self.problems}"
            time.sleep(0.1)

    def click(self, selector: str) -> None:
        """Click on the middle of an element with the mouse, scrolled into view."""
        where = f"document.querySelector({json.dumps(selector)})"
        self.value(f"{where}.scrollIntoView({{block: 'center'}})")
        x, y = self.value(f"(() => {{const r = {where}.getBoundingClientRect();"
                          f" return [r.x + r.width / 2, r.y + r.height / 2]}})()")  # fmt: skip
        for kind in ("mousePressed", "mouseReleased"):
            self._call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def screenshot(self, path: Path | None = None) -> bytes:
        """Return what is in the window as PNG, also written to ``path``."""
        data = base64.b64decode(self._call("Page.captureScreenshot", format="png")["data"])
        if path:
            path.write_bytes(data)
        return data

    def _address(self, port_file: Path) -> str:
        end = time.monotonic() + self.patience
        while time.monotonic() < end:
            lines = port_file.read_text().splitlines() if port_file.exists() else []
            if len(lines) == 2:
                return f"ws://127.0.0.1:{lines[0]}{lines[1]}"
            assert self._process.poll() is None, f"the browser left with exit code {self._process.returncode}"
            time.sleep(0.05)
        raise AssertionError(f"the browser opened no port in {self.patience} s")

    def _call(self, method: str, **arguments: Any) -> dict[str, Any]:
        self._last += 1
        number = self._last
        request: dict[str, Any] = {"id": number, "method": method, "params": arguments}
        if self._session:
            request["sessionId"] = self._session
        self._socket.send(json.dumps(request))
        while number not in self._replies:
            self._hear(json.loads(self._socket.recv(timeout=self.patience)))
        reply = self._replies.pop(number)
        assert "error" not in reply, f"{method}: {reply['error']}"
        found: dict[str, Any] = reply["result"]
        return found

    def _hear(self, message: dict[str, Any]) -> None:
        if "id" in message:
            self._replies[message["id"]] = message
            return
        parameters = message.get("params", {})
        kind = message["method"]
        if kind == "Runtime.exceptionThrown":
            self.problems.append(str(parameters["exceptionDetails"]))
        elif kind == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "assert"):
            self.problems.append(str(parameters["args"]))
        elif kind == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.problems.append(f"{parameters['entry']['text']} {parameters['entry'].get('url', '')}")
        elif kind == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])

    def _stop(self) -> None:
        self._open.close()
        self._process.terminate()
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

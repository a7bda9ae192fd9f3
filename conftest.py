"""What all tests share: which need ROS, and that nothing is skipped unless it is allowed to."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import hypothesis
import pytest
from ros_imports import WHOLE_STACK, kinds_of
from stalled_machine import NOT_JUDGED, StalledMachine, StallMeter

sys.path[:0] = map(str, sorted(Path(__file__).parent.glob("src/quad_*")))

# How long one example takes says nothing on a machine with other work.
hypothesis.settings.register_profile("patient", deadline=None)
# A planted mistake has to be seen, not to be explained by a smallest example.
hypothesis.settings.register_profile(
    "mutation", deadline=None, database=None, phases=(hypothesis.Phase.explicit, hypothesis.Phase.generate)
)
hypothesis.settings.load_profile("patient")

SKIPS = pytest.StashKey[dict[str, str]]()


@pytest.fixture
def own_domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Give the nodes of a test's own process a ROS domain that nothing else uses."""
    from quad_bringup.surroundings import reserved_domain

    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    with reserved_domain(None) as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        yield


@pytest.fixture
def start_node(own_domain: None) -> Iterator[Callable[..., Any]]:  # noqa: ARG001
    """Return ``start(make, *parameters, name="")``, which makes a node in this process with NAME:=VALUE parameters."""
    import rclpy

    from quad_node import executor

    nodes: list[Any] = []

    def start(make: Callable[[], Any], *parameters: str, name: str = "") -> Any:
        words = [word for text in parameters for word in ("-p", text)] + (["-r", f"__node:={name}"] if name else [])
        executor.init(["--ros-args", *words])
        nodes.append(make())
        return nodes[-1]

    yield start
    for made in nodes:
        getattr(made, "node", made).ros.destroy_node()
    rclpy.try_shutdown()


@pytest.fixture
def callbacks(monkeypatch: pytest.MonkeyPatch) -> dict[str, Callable[[Any], None]]:
    """Return {topic: callback} of the nodes made from now on, whose topics no middleware carries."""
    from quad_node.topics import Links

    found: dict[str, Callable[[Any], None]] = {}

    def subscribe(_: Any, topic: str, callback: Any, depth: int = 10, raw: bool = False) -> Any:  # noqa: ARG001
        found[topic] = callback
        return SimpleNamespace(handle=SimpleNamespace(take_message=lambda *_: None))

    monkeypatch.setattr(Links, "subscribe", subscribe)
    return found


@pytest.fixture(scope="session")
def flown() -> Any:
    """Case 1 from the origin with its limits met, 1 s, and what its nodes would say of their parameters."""
    from loop_flight import fly_short

    return fly_short()


@pytest.fixture(scope="session")
def flown_bag(flown: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bag directory of ``flown``, recorded by our writer."""
    from loop_flight import write_flight

    return write_flight(tmp_path_factory.mktemp("flown") / "flight", flown)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add --allowed-skips."""
    parser.addoption("--allowed-skips", type=Path, help="fail if a test is skipped that no line of this file names")


def pytest_configure(config: pytest.Config) -> None:
    """Start with no skips."""
    config.stash[SKIPS] = {}
    config.pluginmanager.register(SkipCollector(config.stash[SKIPS]))
    config.pluginmanager.register(StalledMachine(StallMeter()))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what needs ROS, and what the table of long tests names."""
    _mark_ros(items)
    _mark_long(items)


def _mark_ros(items: list[pytest.Item]) -> None:
    """Mark modules that import ROS, and all whole-stack tests that do not say otherwise."""
    kinds: dict[Path, set[str]] = {}
    for item in items:
        if item.path not in kinds:
            kinds[item.path] = kinds_of(item.path, item.path.read_text(encoding="utf-8"))
        if "ros" in kinds[item.path] and not ("plain" in kinds[item.path] and item.get_closest_marker("unit")):
            item.add_marker("ros")


def _mark_long(items: list[pytest.Item]) -> None:
    """Mark what ``test/long_tests.txt`` names."""
    listed = tuple(names_in(WHOLE_STACK / "long_tests.txt"))
    for item in items:
        if item.nodeid.startswith(listed):
            item.add_marker("long")


class SkipCollector:
    """Notes every skipped module and test, and every expected failure, with its reason."""

    def __init__(self, skips: dict[str, str]) -> None:
        self.skips = skips

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Note a module that was skipped as a whole."""
        self.note(report)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a test that was skipped."""
        self.note(report)

    def note(self, report: pytest.CollectReport | pytest.TestReport) -> None:
        """Keep the reason of a skipped ``report``."""
        if report.skipped:
            where = report.longrepr
            reason = getattr(report, "wasxfail", None) or (where[2] if isinstance(where, tuple) else str(where))
            self.skips[report.nodeid] = reason.removeprefix("Skipped: ")


def names_in(file: Path) -> list[str]:
    """Return the beginnings of test names that ``file`` lists; ``#`` begins a comment."""
    lines = (line.partition("#")[0].strip() for line in file.read_text(encoding="utf-8").splitlines())
    return [line for line in lines if line]


def grown(config: pytest.Config) -> list[str]:
    """Return the skipped tests that the file of --allowed-skips does not name."""
    file = config.getoption("--allowed-skips")
    allowed = tuple(names_in(file)) if file else ("",)
    skips = config.stash[SKIPS]
    return [name for name in skips if not (name.startswith(allowed) or skips[name].startswith(NOT_JUDGED))]


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Fail a run that passed if the set of skips has grown."""
    if exitstatus == pytest.ExitCode.OK and grown(session.config):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Name what was skipped and why, and what must not be."""
    for title, names in (("skipped", list(config.stash[SKIPS])), ("skipped but not allowed to be", grown(config))):
        if names:
            terminalreporter.section(title)
            for name in sorted(names):
                terminalreporter.write_line(f"{name}: {config.stash[SKIPS][name]}")

"""The supervisor against processes and a flight state that a test makes up: the first cause is named."""

import os
import signal

import pytest

from quad_bringup import supervisor
from quad_bringup.supervisor import Interrupted, Interrupts, Outcome, Patience, Supervisor, interrupts
from quad_core.resolution import resolve
from quad_msgs.msg import FlightState
from quad_node.watch import ENDED, FAILED, FLYING, WAITING

PATIENCE = Patience(start=10.0, silence=5.0, answer=2.0)
LANDS = PATIENCE._replace(landing=8.0)
COMMANDED = LANDS._replace(commanded=True)
ALL_LEFT = {"simulator": 0, "trajectory": 0, "recorder": 0}
ALL_FAILED = dict.fromkeys(ALL_LEFT, 1)
NO_NEWS = "flight/state: nothing from simulator after step 42"
KILLED = "trajectory was killed by SIGKILL"
SECOND = "a second signal (Ctrl-C) stops the motors where it is"


@pytest.mark.parametrize("blank", ["", " "])
def test_a_commander_among_the_roles_makes_the_flight_patient_however_they_are_written(blank):
    roles = f",{blank}".join(("simulator", "trajectory", "commander", "recorder"))
    assert Patience.of(resolve("simulator", {"flight.roles": roles})).commanded


@pytest.fixture
def hang_ups_are_heeded():
    """Also where nohup has started the tests."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


def state(phase, step=0, reason=""):
    return FlightState(state=phase, reason=reason, step=step, end_step=1000, wall_time=step * 0.001)


def flies(first, last, codes=None):
    """Return the script of a flight with news every second; ``codes`` end with the first of them."""
    return [(n, state(FLYING, n), codes or {}) if n == first else (n, state(FLYING, n), {}) for n in range(first, last)]


class Flight(Interrupts):
    """A script of (seconds, state or None, {role: exit code}) that plays on a made-up clock.

    ``signals`` {s: name}: what an operator sends, and ``asked`` when the vehicle interface was asked to end.
    """

    def __init__(self, script, monkeypatch, signals=()):
        super().__init__()
        self.flying, self.signals = True, dict(signals)
        self.now, self.stopped = 0.0, 0
        self.asked, self.asked_for, self.reported = [], [], []
        self.script, self.newest, self.alive, self.ended = list(script), None, set(ALL_LEFT), {}
        monkeypatch.setattr(supervisor.time, "monotonic", lambda: self.now)

    def poll(self, patience):
        self.now += patience
        while self.script and self.script[0][0] <= self.now:
            _, said, codes = self.script.pop(0)
            self.newest = said or self.newest
            self.ended.update({role: code for role, code in codes.items() if role in self.alive})
        for at in [at for at in self.signals if at <= self.now]:
            self.note(getattr(signal, self.signals.pop(at)))
        return self.newest

    def running(self):
        return bool(self.alive)

    def vehicle_interface(self):
        return "process" if "simulator" in self.alive else None

    def reap(self):
        gone, self.ended = self.ended, {}
        self.alive -= set(gone)
        return gone

    def newly_stopped(self):
        return {}

    def pids(self):
        return {role: 1 for role in ALL_LEFT if role in self.alive}

    def stop(self):
        self.stopped += 1
        self.alive.clear()

    def interrupt_vehicle_interface(self):
        self.asked.append(self.now)

    def report_failure(self, role, how):
        self.reported.append((role, how))

    def ask_to_end(self, why):
        self.asked_for.append((why, len(self.asked)))

    def supervise(self, patience=PATIENCE, **named):
        return Supervisor(self, self, patience, self, **named).run(lambda _: None)


ENDINGS = {  # script, (cause, how often stopped, at which s)
    "it ends by itself": ([*flies(1, 6), (6, state(ENDED, 1000), ALL_LEFT)], ("", 0, 6.1)),
    "it is over before anything of it is known": (
        [(1, None, {"recorder": 0}), (1.3, None, {"simulator": 0, "trajectory": 0})],
        ("", 0, 1.4),
    ),
    "a node fails before all is known": ([(1, None, {"recorder": 1})], ("recorder ended with exit code 1", 1, 2.1)),
    "it fails, which its bag tells": ([*flies(1, 2), (2, state(FAILED, 70, "diverged"), ALL_FAILED)], ("", 0, 3.1)),
    "a node is killed, and the others notice by themselves": (
        [*flies(1, 2), (2, None, {"trajectory": -9}), (3.5, state(FAILED, 200, "no answer"), ALL_FAILED)],
        (KILLED, 0, 4.6),
    ),
    "it does not start": (
        [(1, state(WAITING, 0, "waiting for recorder"), {})],
        ("the flight did not start: waiting for recorder", 1, 1.0 + PATIENCE.start),
    ),
    "it begins after a node has left": (
        [(1, None, {"trajectory": 0}), (9, state(FLYING, 42), {})],
        (NO_NEWS, 1, 9.0 + PATIENCE.silence),
    ),
    "it is silent": ([(1, state(FLYING, 42), {})], (NO_NEWS, 1, 1.0 + PATIENCE.silence)),
    "its nodes do not leave after it had failed": (
        [*flies(1, 2), (2, state(FAILED, 70, "diverged"), {"simulator": 1})],
        ("the nodes did not leave after the flight had failed: diverged", 1, 2.0 + supervisor._WIND_UP),
    ),
}


@pytest.mark.parametrize("case", ENDINGS)
def test_the_first_cause_of_an_end_is_named_and_what_does_not_leave_is_stopped(case, monkeypatch):
    script, (cause, stopped, at) = ENDINGS[case]
    flight = Flight(script, monkeypatch)
    assert flight.supervise() == Outcome(cause)
    assert (flight.stopped, flight.now) == (stopped, pytest.approx(at, abs=1.2))


def test_without_the_simulator_nobody_is_waited_for(monkeypatch):
    for patience in (PATIENCE, LANDS):
        flight = Flight([*flies(1, 2), (2, None, {"simulator": -11})], monkeypatch)
        assert flight.supervise(patience) == Outcome("simulator was killed by SIGSEGV")
        assert (flight.stopped, flight.asked) == (1, []), "there is nothing left to land"
        assert flight.now < 4.0


def test_a_bridge_that_is_killed_is_named_and_what_its_autopilot_does(monkeypatch):
    flight = Flight([*flies(1, 2), (2, None, {"simulator": -9})], monkeypatch)
    said = "px4_bridge was killed by SIGKILL: the autopilot lands by its own failsafe, unseen"
    assert flight.supervise(LANDS, interface="px4_bridge") == Outcome(said)


@pytest.mark.parametrize(
    ("role", "said"),
    [
        (
            "simulator",
            "px4_bridge was stopped by SIGSTOP and stands still: the autopilot lands by its own failsafe, unseen",
        ),
        ("trajectory", "trajectory was stopped by SIGSTOP and stands still"),
    ],
)
def test_a_process_that_is_stopped_is_named_at_once_and_ends_no_flight_by_that(role, said, monkeypatch, capsys):
    flight = Flight([*flies(1, 4), (4, state(ENDED, 9), ALL_LEFT)], monkeypatch)
    monkeypatch.setattr(flight, "newly_stopped", lambda: {role: signal.SIGSTOP} if 2.0 < flight.now < 2.15 else {})
    assert flight.supervise(COMMANDED, interface="px4_bridge") == Outcome("")
    assert set(capsys.readouterr().err.splitlines()) == {f"fly: {said}"}


def test_nodes_that_do_not_leave_an_ended_flight_are_stopped(monkeypatch):
    flight = Flight([*flies(1, 2), (2, state(ENDED, 1000), {"simulator": 0})], monkeypatch)
    assert flight.supervise() == Outcome("", ("trajectory", "recorder")), "its bag tells how the flight was"
    assert flight.stopped == 1


@pytest.mark.parametrize("known", [None, state(WAITING, 0, "waiting for trajectory")])
def test_a_node_that_leaves_before_the_flight_is_not_waited_for_like_one_that_starts(known, monkeypatch):
    flight = Flight([(1, None, {"trajectory": 0}), (3, known, {})], monkeypatch)
    outcome = flight.supervise(PATIENCE._replace(start=60.0))
    assert outcome == Outcome("trajectory ended with exit code 0 before the flight began")
    assert flight.now < 15.0


WAITS = (0.3, state(WAITING, 0, "waiting for recorder"), {})
INTERRUPTS = {  # script, patience, signals, (how often stopped, how often asked to land, at which s)
    "on the ground all leave": ([WAITS, (0.4, None, ALL_LEFT)], PATIENCE, {0.4: "SIGINT"}, (1, 0, 0.4)),
    "it stops at once what cannot land": (flies(1, 9), PATIENCE, {2.0: "SIGINT"}, (1, 0, 2.0)),
    "a terminal's Ctrl-C has ended the nodes already": (
        [*flies(1, 2), (2, None, {"trajectory": -2, "recorder": -2, "simulator": 0})],
        PATIENCE,
        {2.1: "SIGINT"},
        (1, 0, 3.1),
    ),
    "what can land lands": (
        [*flies(1, 7), (7, state(FAILED, 9, "stopped by SIGINT"), ALL_FAILED)],
        LANDS,
        {2.0: "SIGINT"},
        (0, 1, 8.0),
    ),
    "a landing has a bound": (flies(1, 60), LANDS, {1.1: "SIGINT"}, (1, 1, 1.1 + LANDS.landing)),
    "a second one stops a landing": (flies(1, 60), LANDS, {1.1: "SIGINT", 3.0: "SIGTERM"}, (1, 1, 3.0)),
}


@pytest.mark.parametrize("case", INTERRUPTS)
def test_a_signal_is_the_cause_and_lands_what_can_be_landed(case, monkeypatch):
    script, patience, signals, (stopped, asked, at) = INTERRUPTS[case]
    flight = Flight(script, monkeypatch, signals)
    assert flight.supervise(patience) == Outcome("interrupted by SIGINT")
    assert (flight.stopped, len(flight.asked), flight.asked_for) == (stopped, asked, [])
    assert flight.now == pytest.approx(at, abs=0.3)


@pytest.mark.parametrize("patience", [LANDS, COMMANDED])
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_one_signal_while_a_landing_is_under_way_changes_nothing(name, patience, monkeypatch, capsys):
    """It stopped the motors in the air where fly had begun the landing because a node had died."""
    script = [*flies(1, 2), *flies(2, 9, {"trajectory": -9}), (9, state(FAILED, 9, "stopped"), ALL_FAILED)]
    flight = Flight(script, monkeypatch, {7.0: name})
    assert flight.supervise(patience) == Outcome(KILLED)
    assert (flight.stopped, len(flight.asked)) == (0, 1)
    assert flight.asked[0] < 7.0
    assert capsys.readouterr().err.splitlines() == [
        f"fly: {KILLED}: the vehicle lands",
        f"fly: {name}: the vehicle is landing already; {SECOND}",
    ]


def test_a_second_signal_counts_only_after_the_terminal_has_said_what_it_does(monkeypatch):
    """Fly may be busy for a second or two before it says so."""
    flight = Flight(flies(1, 30), monkeypatch)
    poll = flight.poll

    def slow(patience):
        found = poll(5.0 if 3.0 < flight.now < 8.0 else patience)
        if flight.now > 8.0 and not flight.names:
            flight.names += ["SIGINT", "SIGINT", "SIGTERM"]
        return found

    flight.poll = slow
    flight.supervise(LANDS._replace(landing=15.0))
    assert (len(flight.asked), flight.stopped) == (1, 1)
    assert flight.now > 20.0


def test_a_recorder_that_dies_ends_no_flight_of_a_commander(monkeypatch, capsys):
    script = [*flies(1, 2), *flies(2, 9, {"recorder": -9})]
    flight = Flight([*script, (9, state(ENDED, 9), {"simulator": 0, "trajectory": 0})], monkeypatch)
    assert flight.supervise(COMMANDED) == Outcome("")
    assert (flight.stopped, flight.asked) == (0, [])
    said = "fly: recorder was killed by SIGKILL: the flight goes on, and what is flown from now on is not recorded\n"
    assert capsys.readouterr().err == said
    assert flight.reported == [("recorder", "was killed by SIGKILL")]
    bare = Flight([*script, (9, state(FAILED, 9), ALL_FAILED)], monkeypatch)
    assert bare.supervise(LANDS) == Outcome("recorder was killed by SIGKILL")
    assert len(bare.asked) == 1
    with_a_signal = Flight([*script, (9, state(ENDED, 9), ALL_LEFT)], monkeypatch, {2.0: "SIGINT"})
    assert with_a_signal.supervise(COMMANDED) == Outcome("interrupted by SIGINT")
    assert "fly: recorder was killed by SIGKILL\n" in capsys.readouterr().err


def test_a_landing_from_high_up_has_its_time_as_long_as_there_is_news_of_it(monkeypatch):
    """From 1 km it takes 20 minutes; after 5 of them the motors were stopped."""
    lands = patience_of("simulator,trajectory,commander,position_controller,attitude_controller,recorder", "realtime")
    high = Flight([*flies(1, 1300), (1300, state(ENDED, 1300), ALL_LEFT)], monkeypatch, {1.1: "SIGINT"})
    assert high.supervise(lands) == Outcome("interrupted by SIGINT")
    assert (high.stopped, len(high.asked)) == (0, 1)
    hung = Flight(flies(1, 21), monkeypatch, {1.1: "SIGINT"})
    hung.supervise(lands)
    assert (hung.stopped, hung.now) == (1, pytest.approx(20.0 + lands.silence, abs=0.5))


def test_a_node_that_dies_in_real_time_makes_the_owner_land(monkeypatch):
    script = [*flies(1, 2), *flies(2, 7, {"trajectory": -9}), (7, state(FAILED, 9, "stopped by SIGINT"), ALL_FAILED)]
    without = Flight(script, monkeypatch)
    assert without.supervise(LANDS) == Outcome(KILLED)
    assert (without.asked_for, len(without.asked)) == ([], 1), "nobody is looked for who is not there"
    flight = Flight(script, monkeypatch)
    assert flight.supervise(COMMANDED) == Outcome(KILLED)
    assert (flight.stopped, flight.asked) == (0, [pytest.approx(3.1 + PATIENCE.answer, abs=1.2)])
    assert flight.asked_for == [(KILLED, 0)], "the commander hears why before the signal"


@pytest.mark.parametrize("known", [None, state(WAITING, 0, "waiting for recorder")])
def test_a_vehicle_of_which_no_news_has_come_is_landed_and_not_dropped(known, monkeypatch):
    script = [(1, known, {}), (3, known, {"trajectory": -9}), *flies(5, 10), (10, state(FAILED, 10), ALL_FAILED)]
    flight = Flight(script, monkeypatch)
    assert flight.supervise(LANDS) == Outcome(KILLED)
    assert (flight.stopped, len(flight.asked)) == (0, 1)


def test_a_vehicle_that_waits_on_the_ground_has_little_time_to_leave(monkeypatch):
    flight = Flight([(1, state(WAITING, 0, "waiting for recorder"), {}), (2, None, {"trajectory": -9})], monkeypatch)
    assert flight.supervise(COMMANDED) == Outcome(KILLED)
    assert (flight.stopped, len(flight.asked), flight.asked_for) == (1, 1, [])
    assert flight.now < 3.0 + 1.0 + PATIENCE.answer + 0.5


def test_signals_raise_before_the_flight_are_noted_in_it_and_the_handlers_come_back(monkeypatch, hang_ups_are_heeded):
    """In flight only a later signal asks harder, and never a terminal that hangs up again."""
    before, now = signal.getsignal(signal.SIGTERM), [100.0]
    monkeypatch.setattr(supervisor.time, "monotonic", lambda: now[0])
    with interrupts() as noted:
        with pytest.raises(Interrupted, match="SIGTERM"):
            os.kill(os.getpid(), signal.SIGTERM)
        noted.flying = True
        for name, wait in (("SIGHUP", 0.9), ("SIGTERM", 0.2), ("SIGHUP", 0.0), ("SIGINT", 0.0)):
            os.kill(os.getpid(), getattr(signal, name))
            now[0] += wait
    assert (noted.name, noted.names) == ("SIGHUP", ["SIGHUP", "SIGINT"])
    assert signal.getsignal(signal.SIGTERM) is before


def patience_of(roles, mode):
    return Patience.of(resolve("simulator", {"flight.roles": roles, "flight.mode": mode}))


def test_a_killed_shadow_and_a_recorder_killed_after_it_are_reported_at_once(monkeypatch):
    """In lockstep the plant stands still until then."""
    shadow = "shadow_attitude_controller"
    killed = [(1, state(FLYING, 1), {}), (2, None, {shadow: -9}), (2.15, None, {"recorder": -9})]
    over = (3, state(FAILED, 70, "recorder failed"), {"simulator": 1, "trajectory": 1})
    flight, when = Flight([*killed, over], monkeypatch), []
    flight.alive.add(shadow)
    monkeypatch.setattr(flight, "report_failure", lambda role, _: when.append((role, flight.now)))
    Supervisor(flight, flight, PATIENCE, flight).run(lambda _: None)
    assert when == [(shadow, pytest.approx(2.0)), ("recorder", pytest.approx(2.2))]

"""The supervisor against processes and a flight state that a test makes up: the first cause is named."""

import os
import signal

import pytest

from quad_bringup import supervisor
from quad_bringup.supervisor import Interrupted, Interrupts, Outcome, Patience, interrupts, supervise
from quad_core.resolution import resolve
from quad_node.watch import ENDED, FAILED, FLYING, WAITING, Sighting


@pytest.fixture
def hang_ups_are_heeded():
    """Also where nohup has started the tests."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


PATIENCE = Patience(start=10.0, silence=5.0, answer=2.0)


def state(phase, step=0, reason=""):
    return Sighting(phase, reason, step, 1000, step * 0.002, step * 0.001)


class Flight:
    """A script of (seconds, state or None, {role: exit code}) that plays on a made-up clock."""

    def __init__(self, script, monkeypatch, roles=("simulator", "trajectory", "recorder")):
        self.now, self.stopped = 0.0, 0
        self.asked_at, self.asked_for, self.reported = [], [], []
        self.script = list(script)
        self.newest, self.alive = None, set(roles)
        self.ended = {}
        monkeypatch.setattr(supervisor.time, "monotonic", lambda: self.now)

    def poll(self, patience):
        self.now += patience
        while self.script and self.script[0][0] <= self.now:
            _, said, codes = self.script.pop(0)
            self.newest = said or self.newest
            self.ended.update({role: code for role, code in codes.items() if role in self.alive})
        return self.newest

    def running(self):
        return bool(self.alive)

    def has_owner(self):
        return "simulator" in self.alive

    def reap(self):
        gone, self.ended = self.ended, {}
        self.alive -= set(gone)
        return gone

    def pids(self):
        return {role: 1 for role in ("simulator", "trajectory", "recorder") if role in self.alive}

    def stop(self):
        self.stopped += 1
        self.alive.clear()

    def interrupt_owner(self):
        self.asked_at.append(self.now)

    def report_failure(self, role, how):
        self.reported.append((role, how))

    def ask_to_end(self, why):
        self.asked_for.append((why, len(self.asked_at)))

    def supervise(self, interrupted=None, patience=PATIENCE):
        return supervise(self, self, patience, interrupted or Interrupts(), lambda _: None)


def test_only_a_later_signal_asks_harder(hang_ups_are_heeded, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(supervisor.time, "monotonic", lambda: now[0])
    with interrupts() as noted:
        noted.flying = True
        for name, wait in (("SIGHUP", 0.9), ("SIGTERM", 0.2), ("SIGHUP", 0.0), ("SIGINT", 0.0)):
            os.kill(os.getpid(), getattr(signal, name))
            now[0] += wait
    assert noted.names == ["SIGHUP", "SIGINT"]


ALL_LEFT = {"simulator": 0, "trajectory": 0, "recorder": 0}


LANDS = PATIENCE._replace(landing=8.0)
SIMULATOR_DIES = [(1, state(FLYING, 1), {}), (2, None, {"simulator": -11})]
TRAJECTORY_LEAVES = "trajectory ended with exit code 0 before the flight began"
NO_NEWS = "flight/state: nothing from the simulator after step 42"
ENDINGS = {
    "it ends by itself": (
        [(1, state(FLYING, 1), {}), (4, state(FLYING, 900), {}), (6, state(ENDED, 1000), ALL_LEFT)],
        ("", 0, 6.1),
    ),
    "it is over before anything of it is known": (
        [(1, None, {"recorder": 0}), (1.3, None, {"simulator": 0, "trajectory": 0})],
        ("", 0, 1.4),
    ),
    "a node fails before anything is known": (
        [(1, None, {"recorder": 1})],
        ("recorder ended with exit code 1", 1, 2.1),
    ),
    "it fails by itself, which its bag tells": (
        [(1, state(FLYING, 1), {}), (2, state(FAILED, 70, "diverged"), dict.fromkeys(ALL_LEFT, 1))],
        ("", 0, 3.1),
    ),
    "a node is killed, and the others notice by themselves": (
        [
            (1, state(FLYING, 1), {}),
            (2, None, {"trajectory": -9}),
            (3.5, state(FAILED, 200, "trajectory does not answer"), {"simulator": 1, "recorder": 1}),
        ],
        ("trajectory was killed by SIGKILL", 0, 4.6),
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
        [(1, state(FLYING, 1), {}), (2, state(FAILED, 70, "diverged"), {"simulator": 1})],
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
        flight = Flight(SIMULATOR_DIES, monkeypatch)
        assert flight.supervise(patience=patience) == Outcome("simulator was killed by SIGSEGV")
        assert (flight.stopped, flight.asked_at) == (1, []), "there is nothing left to land"
        assert flight.now < 4.0


def test_nodes_that_do_not_leave_an_ended_flight_are_stopped(monkeypatch):
    flight = Flight([(1, state(FLYING, 1), {}), (2, state(ENDED, 1000), {"simulator": 0})], monkeypatch)
    assert flight.supervise() == Outcome("", ("trajectory", "recorder")), "its bag tells how the flight was"
    assert flight.stopped == 1


@pytest.mark.parametrize("known", [None, state(WAITING, 0, "waiting for trajectory")])
def test_a_node_that_leaves_before_the_flight_is_not_waited_for_like_one_that_starts(known, monkeypatch, capsys):
    flight = Flight([(1, None, {"trajectory": 0}), (3, known, {})], monkeypatch)
    assert flight.supervise(patience=PATIENCE._replace(start=60.0)) == Outcome(TRAJECTORY_LEAVES)
    assert flight.now < 15.0
    assert capsys.readouterr().err == ""


def test_nodes_that_leave_because_they_were_asked_to_are_not_waited_for(monkeypatch, capsys):
    asked = Interrupts()
    asked.names.append("SIGINT")
    flight = Flight([(0.3, state(WAITING, 0, "waiting for recorder"), ALL_LEFT)], monkeypatch)
    monkeypatch.setattr(flight, "stop", lambda: None)
    assert flight.supervise(asked) == Outcome("interrupted by SIGINT")
    assert capsys.readouterr().err == ""


def test_an_interrupt_stops_at_once(monkeypatch):
    asked = Interrupts()
    asked.names.append("SIGINT")
    flight = Flight([(0.05, state(FLYING, 3), {})], monkeypatch)
    assert flight.supervise(asked) == Outcome("interrupted by SIGINT")
    assert (flight.stopped, flight.now) == (1, pytest.approx(0.1))


def test_nodes_that_a_terminal_s_ctrl_c_ended_are_not_the_cause(monkeypatch):
    interrupted = Interrupts()
    flight = Flight([(0.3, None, {"trajectory": -2, "recorder": -2, "simulator": 0})], monkeypatch)
    reap = flight.reap

    def reap_interrupted():
        gone = reap()
        if gone:
            interrupted.names.append("SIGINT")
        return gone

    flight.reap = reap_interrupted
    assert flight.supervise(interrupted) == Outcome("interrupted by SIGINT")


def test_an_interrupt_in_real_time_is_a_landing(monkeypatch):
    asked = Interrupts()
    asked.names.append("SIGINT")
    script = [(0.05, state(FLYING, 3), {}), *((n, state(FLYING, 3 + n), {}) for n in range(1, 6))]
    script.append((6.0, state(FAILED, 9, "simulator stopped by SIGINT"), dict.fromkeys(ALL_LEFT, 1)))
    flight = Flight(script, monkeypatch)
    assert flight.supervise(asked, LANDS) == Outcome("interrupted by SIGINT")
    assert (flight.stopped, flight.asked_at, flight.asked_for) == (0, [pytest.approx(0.1)], [])


class Asking(Interrupts):
    """An operator: the signals that a script gives, {s: name}, on the flight's clock."""

    def __init__(self, flight, signals):
        super().__init__()
        self.flying = True
        poll = flight.poll

        def poll_and_signal(patience):
            found = poll(patience)
            for at in [at for at in signals if at <= flight.now]:
                self.note(getattr(signal, signals.pop(at)))
            return found

        flight.poll = poll_and_signal


@pytest.mark.parametrize("commanded", [False, True])
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_one_signal_while_a_landing_is_under_way_changes_nothing(name, commanded, monkeypatch, capsys):
    """It stopped the motors in the air where fly had begun the landing because a node had died."""
    script = [(1, state(FLYING, 1), {}), (2, state(FLYING, 2), {"trajectory": -9})]
    script += [(n, state(FLYING, n), {}) for n in range(3, 9)]
    script.append((9, state(FAILED, 9, "simulator stopped by SIGINT"), {"simulator": 1, "recorder": 1}))
    flight = Flight(script, monkeypatch)
    asked = Asking(flight, {7.0: name})
    patience = LANDS._replace(commanded=commanded)
    assert flight.supervise(asked, patience) == Outcome("trajectory was killed by SIGKILL")
    assert (flight.stopped, len(flight.asked_at)) == (0, 1)
    assert flight.asked_at[0] < 7.0
    said = capsys.readouterr().err.splitlines()
    assert said == [
        "fly: trajectory was killed by SIGKILL: the vehicle lands",
        f"fly: {name}: the vehicle is landing already; a second signal (Ctrl-C) stops the motors where it is",
    ]


def landing_flight(monkeypatch):
    script = [(1, state(FLYING, 1), {}), (2, state(FLYING, 2), {"trajectory": -9})]
    return Flight([*script, *((n, state(FLYING, n), {}) for n in range(3, 30))], monkeypatch)


def test_a_second_signal_stops_a_landing_that_fly_has_begun(monkeypatch, capsys):
    flight = landing_flight(monkeypatch)
    asked = Asking(flight, {7.0: "SIGTERM", 8.5: "SIGINT"})
    assert flight.supervise(asked, LANDS._replace(landing=60.0)) == Outcome("trajectory was killed by SIGKILL")
    assert (flight.stopped, flight.now) == (1, pytest.approx(8.5, abs=0.2))
    assert "a second signal (Ctrl-C) stops the motors where it is" in capsys.readouterr().err


def test_a_terminal_that_goes_lands_however_often_it_hangs_up(monkeypatch, hang_ups_are_heeded):
    flight = landing_flight(monkeypatch)
    asked = Asking(flight, {float(n): "SIGHUP" for n in range(3, 25)})
    flight.supervise(asked, LANDS._replace(landing=60.0))
    assert flight.now > 30.0


def test_a_node_that_was_killed_just_before_a_signal_is_named_beside_it(monkeypatch, capsys):
    script = [(1, state(FLYING, 1), {}), (2, state(FLYING, 2), {"recorder": -9})]
    flight = Flight([*script, (5, state(ENDED, 9), {"simulator": 0, "trajectory": 0})], monkeypatch)
    asked = Asking(flight, {2.0: "SIGINT"})
    assert flight.supervise(asked, LANDS._replace(commanded=True)) == Outcome("interrupted by SIGINT")
    assert "fly: recorder was killed by SIGKILL\n" in capsys.readouterr().err


def test_a_second_signal_counts_only_after_the_terminal_has_said_what_it_does(monkeypatch):
    """Fly may be busy for a second or two before it says so."""
    flight = Flight([(n, state(FLYING, n), {}) for n in range(1, 30)], monkeypatch)
    poll = flight.poll

    def slow(patience):
        found = poll(5.0 if 3.0 < flight.now < 8.0 else patience)
        if flight.now > 8.0 and not asked.names:
            asked.names += ["SIGINT", "SIGINT", "SIGTERM"]
        return found

    flight.poll, asked = slow, Interrupts()
    flight.supervise(asked, LANDS._replace(landing=15.0))
    assert (len(flight.asked_at), flight.stopped) == (1, 1)
    assert flight.now > 20.0


def test_a_recorder_that_dies_ends_no_flight_of_a_commander(monkeypatch, capsys):
    script = [(1, state(FLYING, 1), {}), (2, state(FLYING, 2), {"recorder": -9})]
    script += [(n, state(FLYING, n), {}) for n in range(3, 9)]
    script.append((9, state(ENDED, 9), {"simulator": 0, "trajectory": 0}))
    flight = Flight(script, monkeypatch)
    assert flight.supervise(patience=LANDS._replace(commanded=True)) == Outcome("")
    assert (flight.stopped, flight.asked_at) == (0, [])
    said = "fly: recorder was killed by SIGKILL: the flight goes on, and what is flown from now on is not recorded\n"
    assert capsys.readouterr().err == said
    bare = Flight([*script[:-1], (9, state(FAILED, 9), dict.fromkeys(ALL_LEFT, 1))], monkeypatch)
    assert bare.supervise(patience=LANDS) == Outcome("recorder was killed by SIGKILL")
    assert len(bare.asked_at) == 1


def test_a_landing_from_high_up_has_its_time_as_long_as_there_is_news_of_it(monkeypatch):
    """From 1 km it takes 20 minutes; after 5 of them the motors were stopped."""
    lands = patience_of("simulator,trajectory,commander,position_controller,attitude_controller,recorder", "realtime")
    asked = Interrupts()
    asked.names.append("SIGINT")
    script = [(n, state(FLYING, n), {}) for n in range(1, 1300)]
    high = Flight([*script, (1300, state(ENDED, 1300), ALL_LEFT)], monkeypatch)
    high.poll(1.0)
    assert high.supervise(asked, lands) == Outcome("interrupted by SIGINT")
    assert (high.stopped, len(high.asked_at)) == (0, 1)
    hung = Flight(script[:20], monkeypatch)
    hung.poll(1.0)
    asked = Interrupts()
    asked.names.append("SIGINT")
    hung.supervise(asked, lands)
    assert hung.stopped == 1
    assert hung.now == pytest.approx(20.0 + lands.silence, abs=0.5)


def test_a_landing_has_a_bound(monkeypatch):
    asked = Interrupts()
    asked.names.append("SIGINT")
    flight = Flight([(n, state(FLYING, n), {}) for n in range(1, 60)], monkeypatch)
    flight.poll(1.0)
    assert flight.supervise(asked, LANDS) == Outcome("interrupted by SIGINT")
    assert (flight.stopped, len(flight.asked_at)) == (1, 1)
    assert flight.now == pytest.approx(1.1 + LANDS.landing, abs=0.5)


def test_a_second_interrupt_stops_a_landing_at_once(monkeypatch):
    asked = Interrupts()
    asked.names.append("SIGINT")
    flight = Flight([(0.05, state(FLYING, 3), {})], monkeypatch)
    ask = flight.interrupt_owner
    monkeypatch.setattr(flight, "interrupt_owner", lambda: (ask(), asked.names.append("SIGTERM")))
    assert flight.supervise(asked, LANDS) == Outcome("interrupted by SIGINT")
    assert (flight.stopped, flight.now) == (1, pytest.approx(0.2))


def test_a_node_that_dies_in_real_time_makes_the_owner_land(monkeypatch):
    script = [(1, state(FLYING, 1), {}), (2, state(FLYING, 2), {"trajectory": -9})]
    script += [(n, state(FLYING, n), {}) for n in range(3, 7)]
    script.append((7, state(FAILED, 9, "simulator stopped by SIGINT"), {"simulator": 1, "recorder": 1}))
    without = Flight(script, monkeypatch)
    assert without.supervise(patience=LANDS) == Outcome("trajectory was killed by SIGKILL")
    assert (without.asked_for, len(without.asked_at)) == ([], 1), "nobody is looked for who is not there"
    flight = Flight(script, monkeypatch)
    assert flight.supervise(patience=LANDS._replace(commanded=True)) == Outcome("trajectory was killed by SIGKILL")
    assert flight.stopped == 0
    assert flight.asked_at == [pytest.approx(3.1 + PATIENCE.answer, abs=1.2)]
    assert flight.asked_for == [("trajectory was killed by SIGKILL", 0)], "the commander hears why before the signal"


@pytest.mark.parametrize("known", [None, state(WAITING, 0, "waiting for recorder")])
def test_a_vehicle_of_which_no_news_has_come_is_landed_and_not_dropped(known, monkeypatch):
    script = [(1, known, {}), (3, known, {"trajectory": -9}), (5, state(FLYING, 2000), {})]
    script += [(n, state(FLYING, 1000 * n), {}) for n in range(6, 10)]
    script.append((10, state(FAILED, 9500, "landed"), {"simulator": 1, "recorder": 1}))
    flight = Flight(script, monkeypatch)
    assert flight.supervise(patience=LANDS) == Outcome("trajectory was killed by SIGKILL")
    assert (flight.stopped, len(flight.asked_at)) == (0, 1)


def test_a_vehicle_that_waits_on_the_ground_has_little_time_to_leave(monkeypatch):
    flight = Flight([(1, state(WAITING, 0, "waiting for recorder"), {}), (2, None, {"trajectory": -9})], monkeypatch)
    assert flight.supervise(patience=LANDS._replace(commanded=True)) == Outcome("trajectory was killed by SIGKILL")
    assert (flight.stopped, len(flight.asked_at), flight.asked_for) == (1, 1, [])
    assert flight.now < 3.0 + 1.0 + PATIENCE.answer + 0.5


def test_signals_raise_before_the_flight_are_noted_in_it_and_the_handlers_come_back():
    before = signal.getsignal(signal.SIGTERM)
    with interrupts() as noted:
        with pytest.raises(Interrupted, match="SIGTERM"):
            os.kill(os.getpid(), signal.SIGTERM)
        noted.flying = True
        os.kill(os.getpid(), signal.SIGTERM)
        assert noted.name == "SIGTERM"
    assert signal.getsignal(signal.SIGTERM) is before


def patience_of(roles, mode):
    flight = {"flight.roles": roles, "flight.mode": mode}
    return Patience.of(resolve("simulator", flight))


def test_on_a_busy_machine_a_commander_in_lockstep_lands_before_it_is_asked_to():
    """At a tenth of real time the 2 s without a mission reference, after which it lands, take 20 s."""
    flown = "simulator,trajectory,commander,position_controller,attitude_controller,recorder"
    bare = flown.replace("commander,", "")
    assert patience_of(flown, "lockstep").answer >= 20.0 + patience_of(bare, "lockstep").answer
    assert patience_of(flown, "realtime").answer == patience_of(bare, "realtime").answer < 20.0


def test_a_recorder_killed_after_a_shadow_is_reported_at_once(monkeypatch):
    """In lockstep the plant stands still until then."""
    killed = [(1, state(FLYING, 1), {}), (2, None, {"shadow": -9}), (2.15, None, {"recorder": -9})]
    over = (3, state(FAILED, 70, "recorder failed"), {"simulator": 1, "trajectory": 1})
    flight = Flight([*killed, over], monkeypatch, ("simulator", "trajectory", "recorder", "shadow"))
    when = []
    monkeypatch.setattr(flight, "report_failure", lambda role, _: when.append((role, flight.now)))
    supervise(flight, flight, PATIENCE, Interrupts(), lambda _: None, ("shadow",))
    assert when == [("recorder", pytest.approx(2.2))]

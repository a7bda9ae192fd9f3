"""Simulated logs as identification takes them."""

from simulated import Manoeuvre, Noise, Truth, flown

from quad_identify.record import Flight, Samples


def flight_of(signals, every=1, motors_every=1, without=()):
    """Return a simulated log with every so many samples, its motors rarer still, ``without`` some signals."""
    t = signals["t"]
    found = {
        name: Samples(t[::every], signals[name].reshape(len(t), -1)[::every])
        for name in signals
        if name not in ("t", *without)
    }
    found["motors"] = Samples(t[::motors_every], signals["motors"][::motors_every])
    return Flight(**found)


def log_of(truth=Truth(), manoeuvre=Manoeuvre(duration=25.0), noise=Noise(), **how):  # noqa: B008
    """Return the log of a flight of ``truth``."""
    return flight_of(flown(truth, manoeuvre, noise), **how)

"""Modes, missions, arming and the references of take-off, hold and landing.

All but ``node``, ``preflight``, ``services`` and ``command`` is pure code, without ROS.

Between the trajectory and the position controller: ``mission/reference`` comes in, ``reference`` goes out. One step of
the node (100 Hz; in lockstep a multiple of the plant step) is ``commander_core.CommanderCore.step``.
"""

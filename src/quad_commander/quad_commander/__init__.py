"""Modes, missions, arming and the references of take-off, hold and landing: pure code, and a node on top.

Between the trajectory and the position controller: ``mission/reference`` comes in, ``reference`` goes out. One step of
the node (100 Hz; in lockstep a multiple of the plant step) is ``commander_core.CommanderCore.step``.
"""

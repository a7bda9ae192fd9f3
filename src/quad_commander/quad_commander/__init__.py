"""Modes, missions, arming and the references of take-off, hold and landing: pure code, and a node on top.

Between the trajectory and the position controller: ``mission/reference`` comes in, ``reference`` goes out. What is
done at each of the node's steps (100 Hz; in lockstep a multiple of the plant step) stands in ``commander_core``:

1. Observe: fill ``modes.Health`` (ages are own steps times period in both clocks; tilt, wrench and contact are the
   guard's, whose report is an input). While ARMING also ``preflight.Preflight.refusals``, every 0.3 s.
2. Ask: an operator's request, else what ``missions.next_request`` asks for, given the last decision.
3. Decide: ``decision, memory = modes.step(parameters, memory, health, request, dt)``.
4. Refer: if ``decision.changed``, plan from the reference sent last (``references.from_state`` after DESCEND); MISSION
   takes ``plan_hand_over`` and ``handed_over``, the other modes ``plan_mode`` and ``sample``.
5. Say: mode, reason and reference travel in one message; ``decision.guard_request`` goes to the vehicle interface,
   which hands it to ``quad_guard.guard.step`` at every plant step until the next one comes. In DISARMED the vehicle
   interface keeps the motors off and does not run the guard; in PILOT it sends nothing.

Each request is recorded with its step, answer and ``blocked_by``; a refused one is reported when it changes, not at
every step of a mission that keeps asking.
"""

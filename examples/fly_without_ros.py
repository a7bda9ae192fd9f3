"""A flight without ROS: Case 1 of the paper in plain Python, some 40,000 steps of the cascade.

Run it in a shell with scripts/env.sh sourced: python examples/fly_without_ros.py
"""

from quad_flight import flight

planned = flight.from_names("case1", preset="tuned", seed=1)
result = flight.fly(planned)
print(f"{result.outcome} after {result.steps} steps, position error {1e3 * result.rmse:.1f} mm RMS")
print(f"largest torque {abs(result.topics['wrench_setpoint']['torque_b']).max():.2f} N m")

"""Install with: python -m pip install --no-build-isolation --no-deps examples/my_attitude_law."""

from setuptools import setup

setup()

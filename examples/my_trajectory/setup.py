"""Install with: python -m pip install --no-build-isolation examples/my_trajectory."""

from setuptools import setup

setup()

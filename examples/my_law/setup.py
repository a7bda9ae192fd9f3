"""Install with: python -m pip install --no-build-isolation examples/my_law."""

from setuptools import setup

setup()

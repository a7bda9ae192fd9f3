"""Install with: python -m pip install --no-build-isolation examples/my_plant."""

from setuptools import setup

setup()

"""Install with: python -m pip install --no-build-isolation --no-deps examples/my_plant."""

from setuptools import setup

setup()

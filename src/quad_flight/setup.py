from pathlib import Path

from setuptools import find_packages, setup

CONFIGURATION = sorted(Path("quad_flight/config").iterdir())

setup(
    name="quad_flight",
    version="0.2.0",
    description="A flight of the quadrotor stack without ROS: set-up, loop, score, sweeps; plain or compiled.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_flight", "quad_flight.*"]),
    # inside the package, so that they are found however it is installed, with or without ament
    package_data={"": ["py.typed"], "quad_flight": ["config/*/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_flight"]),
        ("share/quad_flight", ["package.xml"]),
        # and where users of ROS look for it
        *((f"share/quad_flight/config/{kind.name}", sorted(map(str, kind.glob("*.yaml")))) for kind in CONFIGURATION),
    ],
    zip_safe=False,
    install_requires=["numpy"],
    extras_require={"test": ["pytest"]},
)

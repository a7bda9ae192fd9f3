from setuptools import find_packages, setup

setup(
    name="quad_commander",
    version="0.2.0",
    description="Modes, missions and arming of the quadrotor stack, and the references of take-off, hold and landing.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_commander", "quad_commander.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_commander"]),
        ("share/quad_commander", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": ["commander = quad_commander.node:main", "command = quad_commander.command:main"],
        "quad.nodes": ["commander = quad_commander.parameters:ROLE"],
    },
)

from setuptools import find_packages, setup

setup(
    name="quad_mavlink",
    version="0.2.0",
    description="Bridge between a flight and PX4 or ArduPilot over MAVLink, and our plants under PX4.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_mavlink", "quad_mavlink.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_mavlink"]),
        ("share/quad_mavlink", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": ["joined_plant = quad_mavlink.joined:main", "mavlink_bridge = quad_mavlink.node:main"],
        "quad.vehicles": [
            "joined_plant = quad_mavlink.parameters:JOINED_INTERFACE",
            "mavlink_bridge = quad_mavlink.parameters:INTERFACE",
        ],
    },
)

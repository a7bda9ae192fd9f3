from setuptools import find_packages, setup

setup(
    name="quad_px4",
    version="0.2.0",
    description="Bridge between a flight and PX4 over uXRCE-DDS.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_px4", "quad_px4.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_px4"]),
        ("share/quad_px4", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": ["px4_bridge = quad_px4.node:main"],
        "quad.vehicles": ["px4_bridge = quad_px4.parameters:INTERFACE"],
    },
)

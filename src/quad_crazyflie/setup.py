from setuptools import find_packages, setup

setup(
    name="quad_crazyflie",
    version="0.2.0",
    description="Bridge between a flight and a Crazyflie over cflib.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_crazyflie", "quad_crazyflie.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_crazyflie"]),
        ("share/quad_crazyflie", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": ["crazyflie_bridge = quad_crazyflie.node:main"],
        "quad.vehicles": ["crazyflie_bridge = quad_crazyflie.parameters:INTERFACE"],
    },
)

from setuptools import find_packages, setup

setup(
    name="quad_dynamics",
    version="0.2.0",
    description="Plants and disturbances of the quadrotor stack and the simulator node.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_dynamics", "quad_dynamics.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_dynamics"]),
        ("share/quad_dynamics", ["package.xml"]),
    ],
    zip_safe=False,
    install_requires=["numpy"],
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": ["check_plant = quad_dynamics.check_plant:main", "simulator = quad_dynamics.node:main"],
        "quad.plant": ["paper = quad_dynamics.paper", "rigid_body = quad_dynamics.rigid_body"],
        "quad.disturbance": [
            "held_gaussian = quad_dynamics.held_gaussian",
            "none = quad_dynamics.no_disturbance",
            "timeline = quad_dynamics.timeline",
        ],
        "quad.sensing": ["hand = quad_dynamics.hand", "sensor = quad_dynamics.sensor"],
    },
)

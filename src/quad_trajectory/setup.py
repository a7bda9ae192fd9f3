from setuptools import find_packages, setup

setup(
    name="quad_trajectory",
    version="0.2.0",
    description="Reference trajectories of the quadrotor stack and the node that publishes them.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_trajectory", "quad_trajectory.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_trajectory"]),
        ("share/quad_trajectory", ["package.xml"]),
    ],
    zip_safe=False,
    install_requires=["numpy"],
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": ["trajectory = quad_trajectory.node:main"],
        "quad.trajectory": [
            "case1 = quad_trajectory.case1",
            "case2 = quad_trajectory.case2",
            "file = quad_trajectory.file",
            "hover = quad_trajectory.hover",
            "identify = quad_trajectory.identify",
            "lemniscate = quad_trajectory.lemniscate",
            "waypoints = quad_trajectory.waypoints",
        ],
    },
)

from setuptools import find_packages, setup

setup(
    name="quad_node",
    version="0.2.0",
    description="The rclpy shell shared by all nodes of the quadrotor stack.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_node", "quad_node.*"]),
    package_data={"": ["py.typed", "*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_node"]),
        ("share/quad_node", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={"console_scripts": ["odometry_relay = quad_node.odometry_relay:main"]},
)

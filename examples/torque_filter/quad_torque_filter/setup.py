from setuptools import setup

setup(
    name="quad_torque_filter",
    version="0.2.0",
    description="A low-pass of the torque between attitude law and plant: an example of a new stage.",
    license="Apache-2.0",
    packages=["quad_torque_filter"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_torque_filter"]),
        ("share/quad_torque_filter", ["package.xml"]),
    ],
    zip_safe=False,
    entry_points={
        "console_scripts": ["torque_filter = quad_torque_filter.node:main"],
        "quad.stages": ["torque_filter = quad_torque_filter.stage:STAGE"],
        "quad.torque_filter": ["low_pass = quad_torque_filter.low_pass"],
    },
)

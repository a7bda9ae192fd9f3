from setuptools import find_packages, setup

setup(
    name="quad_position_ctrl",
    version="0.2.0",
    description="Position laws of the quadrotor stack (adaptive integral backstepping) and their node.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_position_ctrl", "quad_position_ctrl.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_position_ctrl"]),
        ("share/quad_position_ctrl", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": ["position_controller = quad_position_ctrl.node:main"],
        "quad.stages": ["position_controller = quad_position_ctrl.stage:STAGE"],
        "quad.position_law": [
            "aibs = quad_position_ctrl.aibs",
            "geometric_pid = quad_position_ctrl.geometric_pid",
            "ibs = quad_position_ctrl.ibs",
            "indi = quad_position_ctrl.indi",
            "l1 = quad_position_ctrl.l1",
            "pid = quad_position_ctrl.pid",
            "se3 = quad_position_ctrl.se3",
        ],
    },
)

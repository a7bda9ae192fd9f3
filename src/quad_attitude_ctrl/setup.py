from setuptools import find_packages, setup

setup(
    name="quad_attitude_ctrl",
    version="0.2.0",
    description="Attitude laws of the quadrotor stack (adaptive integral terminal sliding mode) and their node.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_attitude_ctrl", "quad_attitude_ctrl.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_attitude_ctrl"]),
        ("share/quad_attitude_ctrl", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": ["attitude_controller = quad_attitude_ctrl.node:main"],
        "quad.stages": ["attitude_controller = quad_attitude_ctrl.stage:STAGE"],
        "quad.attitude_law": [
            "abfnitsm = quad_attitude_ctrl.abfnitsm",
            "abfnitsm_so3 = quad_attitude_ctrl.abfnitsm_so3",
            "geometric_pid = quad_attitude_ctrl.geometric_pid",
            "indi = quad_attitude_ctrl.indi",
            "itsm = quad_attitude_ctrl.itsm",
            "pid = quad_attitude_ctrl.pid",
            "se3 = quad_attitude_ctrl.se3",
        ],
    },
)

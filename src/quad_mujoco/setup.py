from setuptools import find_packages, setup

setup(
    name="quad_mujoco",
    version="0.2.0",
    description="The quadrotor integrated by MuJoCo behind the topics of the simulator node.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_mujoco", "quad_mujoco.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_mujoco"]),
        ("share/quad_mujoco", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={"quad.plant": ["mujoco = quad_mujoco.plant"]},
)

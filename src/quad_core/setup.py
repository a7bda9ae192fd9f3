from setuptools import find_packages, setup

setup(
    name="quad_core",
    version="0.2.0",
    description="ROS-free ground of the quadrotor stack: types, parameters, rotations, plug-ins, compilation.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_core", "quad_core.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_core"]),
        ("share/quad_core", ["package.xml"]),
    ],
    zip_safe=False,
    install_requires=["numpy", "PyYAML"],
    extras_require={"test": ["pytest"]},
)

from setuptools import find_packages, setup

setup(
    name="quad_guard",
    version="0.2.0",
    description="The guard of a quadrotor: checks of commands and states, their limits, and a backup law that lands.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_guard", "quad_guard.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_guard"]),
        ("share/quad_guard", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
)

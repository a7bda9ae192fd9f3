from setuptools import find_packages, setup

setup(
    name="quad_identify",
    version="0.2.0",
    description="Parameters of a vehicle from logs of its flights, each with interval and verdict.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_identify", "quad_identify.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_identify"]),
        ("share/quad_identify", ["package.xml"]),
    ],
    zip_safe=False,
    install_requires=["numpy", "scipy"],
    extras_require={"test": ["pytest"]},
    entry_points={"console_scripts": ["identify = quad_identify.cli:console"]},
)

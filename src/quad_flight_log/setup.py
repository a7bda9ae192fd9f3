from setuptools import find_packages, setup

setup(
    name="quad_flight_log",
    version="0.2.0",
    description="Bags of flights: recorder node, reader, writer, export.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_flight_log", "quad_flight_log.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_flight_log"]),
        ("share/quad_flight_log", ["package.xml"]),
    ],
    zip_safe=False,
    install_requires=["mcap", "numpy", "PyYAML", "rosbags", "zstandard"],
    extras_require={"test": ["pytest"]},
    entry_points={"console_scripts": ["recorder = quad_flight_log.node:main"]},
)

from setuptools import find_packages, setup

setup(
    name="quad_log_import",
    version="0.2.0",
    description="Logs of others (ULog, MAVLink, Crazyflie, rosbag2, CSV, Parquet) as bags.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_log_import", "quad_log_import.*"]),
    package_data={"": ["py.typed", "maps/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_log_import"]),
        ("share/quad_log_import", ["package.xml"]),
    ],
    zip_safe=False,
    install_requires=["numpy", "rosbags", "scipy"],
    extras_require={"test": ["pytest"]},
)

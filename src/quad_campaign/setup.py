from setuptools import find_packages, setup

setup(
    name="quad_campaign",
    version="0.2.0",
    description="Many flights of the quadrotor stack without ROS: campaigns and their reports.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_campaign", "quad_campaign.*"]),
    package_data={"": ["py.typed"], "quad_campaign": ["config/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_campaign"]),
        ("share/quad_campaign", ["package.xml"]),
    ],
    zip_safe=False,
    install_requires=["dask", "distributed", "numpy", "pandas", "scipy", "tqdm"],
    extras_require={"test": ["pytest"]},
)

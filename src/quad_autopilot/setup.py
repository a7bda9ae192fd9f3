from setuptools import find_packages, setup

setup(
    name="quad_autopilot",
    version="0.2.0",
    description="What the bridges to autopilots share.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_autopilot", "quad_autopilot.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_autopilot"]),
        ("share/quad_autopilot", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
)

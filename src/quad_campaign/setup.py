from pathlib import Path

from setuptools import find_packages, setup


def share(*patterns: str) -> list[tuple[str, list[str]]]:
    paths = sorted(path for pattern in patterns for path in Path().glob(pattern))
    return [(f"share/quad_campaign/{path.parent}", [str(path)]) for path in paths]


setup(
    name="quad_campaign",
    version="0.1.0",
    description="Closed-loop flights of the quadrotor stack without ROS: sweeps and batches from the same code.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_campaign", "quad_campaign.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_campaign"]),
        ("share/quad_campaign", ["package.xml"]),
        *share("config/**/*.yaml"),
    ],
    zip_safe=False,
)

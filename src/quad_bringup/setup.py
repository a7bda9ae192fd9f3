from pathlib import Path

from setuptools import find_packages, setup


def share(*patterns: str) -> list[tuple[str, list[str]]]:
    paths = sorted(path for pattern in patterns for path in Path().glob(pattern))
    return [(f"share/quad_bringup/{path.parent}", [str(path)]) for path in paths]


setup(
    name="quad_bringup",
    version="0.2.0",
    description="Launch files, configuration and the flight command of the quadrotor stack.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_bringup", "quad_bringup.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_bringup"]),
        ("share/quad_bringup", ["package.xml"]),
        *share("launch/*.py"),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={"console_scripts": ["fly = quad_bringup.start:main", "one_process = quad_bringup.one_process:main"]},
)

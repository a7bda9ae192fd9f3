from setuptools import find_packages, setup

setup(
    name="quad_analysis",
    version="0.2.0",
    description="What a recorded flight tells: metrics, verdict, replay, shadow, refly.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_analysis", "quad_analysis.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_analysis"]),
        ("share/quad_analysis", ["package.xml"]),
    ],
    zip_safe=False,
    install_requires=["numpy"],
    extras_require={"test": ["pytest"]},
)

from setuptools import find_packages, setup

setup(
    name="quad_native",
    version="0.1.0",
    description="Optional machine code of pure functions: the same text, the same bits, a fraction of the time.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_native", "quad_native.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_native"]),
        ("share/quad_native", ["package.xml"]),
    ],
    zip_safe=False,
)

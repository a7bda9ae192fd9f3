from setuptools import find_packages, setup

setup(
    name="quad_report",
    version="0.2.0",
    description="A recorded flight for people: figures, HTML page, live view, the command log.",
    license="Apache-2.0",
    packages=find_packages(include=["quad_report", "quad_report.*"]),
    package_data={"": ["py.typed", "*.css", "*.js"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/quad_report"]),
        ("share/quad_report", ["package.xml"]),
    ],
    zip_safe=False,
    install_requires=["numpy"],
    extras_require={"test": ["pytest"]},
    entry_points={"console_scripts": ["log = quad_report.cli:console"]},
)

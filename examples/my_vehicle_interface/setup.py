from setuptools import setup

setup(
    name="my_vehicle_interface",
    version="0.1.0",
    description="A vehicle interface of your own: the node that owns the vehicle of a flight.",
    license="Apache-2.0",
    packages=["my_vehicle_interface"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/my_vehicle_interface"]),
        ("share/my_vehicle_interface", ["package.xml"]),
    ],
    zip_safe=False,
    entry_points={
        "console_scripts": ["my_bridge = my_vehicle_interface.node:main"],
        "quad.vehicles": ["my_bridge = my_vehicle_interface.interface:INTERFACE"],
    },
)

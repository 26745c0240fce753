"""The node as an ament_python package; `pip install urdyn` provides all that it does."""

from setuptools import setup

NAME = "urdyn_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/urdyn.launch.py"]),
        (f"share/{NAME}/config", ["config/urdyn.yaml"]),
    ],
    install_requires=["setuptools", "urdyn"],
    entry_points={"console_scripts": [f"twin = {NAME}.node:main"]},
)

"""Install this package, by catkin or by pip alone: it needs neither ROS nor catkin_pkg, only its package.xml."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

MANIFEST = ElementTree.parse(Path(__file__).with_name("package.xml"))  # noqa: S314 - our own file


def _said(tag: str) -> str:
    return " ".join((MANIFEST.findtext(tag) or "").split())


setup(
    name=_said("name"),
    version=_said("version"),
    description=_said("description"),
    license=_said("license"),
    packages=find_packages("src"),
    package_dir={"": "src"},
    python_requires=">=3.11",
    install_requires=["click", "lz4", "matplotlib", "numpy", "rich", "rosbags", "scipy"],
    entry_points={"console_scripts": ["metacontrol-bag=metacontrol_bags.cli.main:main"]},
)

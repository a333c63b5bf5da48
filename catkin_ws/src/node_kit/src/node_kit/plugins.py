"""Plug-ins, the ROS way: what packages on ROS_PACKAGE_PATH export in their package.xml."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import rospkg
from catkin_pkg.package import InvalidPackage


def exported(tag: str) -> Iterator[tuple[str, Mapping[str, str]]]:
    """Yield (package, attributes) of every `<export><TAG .../></export>`, in the order of the packages' names.

    A package.xml that can't be read is passed over: somebody else's broken package is no reason to do nothing.
    """
    packages = rospkg.RosPack()
    for package in sorted(packages.list()):
        try:
            exports = packages.get_manifest(package).exports
        except (rospkg.InvalidManifest, rospkg.ResourceNotFound, InvalidPackage):
            continue
        for export in exports:
            if export.tag == tag:
                yield package, export.attrs

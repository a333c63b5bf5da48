"""Launch files as roslaunch reads them."""

from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader


def read(path):
    """Return what roslaunch makes of a file, without what a roscore has: to read that, it runs two programs."""
    config = ROSLaunchConfig()
    XmlLoader().load(str(path), config, verbose=False)
    return config

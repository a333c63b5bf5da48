from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=["ros_model", "ros_model.commands", "ros_model.extraction", "ros_model.generators"],
        package_dir={"": "src"},
        package_data={"ros_model": ["grammar/*.lark", "schema/*.json", "generators/templates/*.template"]},
    )
)

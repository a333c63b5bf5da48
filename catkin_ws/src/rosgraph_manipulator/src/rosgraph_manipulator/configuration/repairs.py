"""The section `repairs` of the manipulator's configuration: by what each component is repaired."""

from __future__ import annotations

import re
from collections.abc import Mapping

from rosgraph_manipulator.configuration.configurations import (
    ARGUMENT,
    Configuration,
    ConfigurationError,
    FindLaunchFile,
    Repair,
)

FUNCTION = "repair_of_{}"
"""Name of the function, and of its only configuration, by which the launcher runs the driver of a component."""

_KEYS = ("service", "launch")
_LAUNCH_KEYS = ("package", "file", "args")
_GRAPH_NAME = re.compile(r"/?[A-Za-z]\w*(/\w+)*")
_FORM = "give 'service: NAME' or 'launch: {package: PKG, file: FILE, args: {...}}'"


def parse_repairs(
    entries: object, configurations: Mapping[str, Configuration], find_launch_file: FindLaunchFile
) -> dict[str, Repair]:
    """Check the section `repairs`.

    A launch file that is missing is the `problem` of its driver; the other repairs can be made without it.

    Args:
        entries: `COMPONENT: {service: NAME}` or `COMPONENT: {launch: {package: PKG, file: FILE, args: {NAME: VALUE}}}`.
            Without a package, the file is a path.
        configurations: those that can be deployed, by name.
        find_launch_file: finds the launch file of a driver.

    Raises:
        ConfigurationError: an entry has a form that cannot be used.
    """
    if entries is None:
        return {}
    if not isinstance(entries, Mapping):
        raise ConfigurationError(f"parameter 'repairs' must be of the form {{COMPONENT: {{...}}}}: {_FORM}")
    repairs = {str(name): _repair(str(name), entry, find_launch_file) for name, entry in entries.items()}
    functions = {configuration.function for configuration in configurations.values()}
    for component, repair in repairs.items():
        name = FUNCTION.format(component)
        if repair.driver and (name in configurations or name in functions):
            raise ConfigurationError(
                f"repairs/{component}: the name {name} is that of a configuration or function, too: rename that one"
            )
    return repairs


def _repair(component: str, entry: object, find_launch_file: FindLaunchFile) -> Repair:
    where = f"repairs/{component}"
    if not isinstance(entry, Mapping):
        raise ConfigurationError(f"{where} is {entry!r}: {_FORM}")
    _refuse_unknown(where, entry, _KEYS)
    if len(entry) != 1:
        raise ConfigurationError(f"{where}: {'both' if entry else 'neither'} of service and launch given: {_FORM}")
    if "launch" in entry:
        return Repair(component, driver=_driver(component, entry["launch"], find_launch_file))
    service = entry["service"]
    if not isinstance(service, str) or not _GRAPH_NAME.fullmatch(service):
        raise ConfigurationError(f"{where}/service is {service!r}: it must be the name of a service, e.g. laser/reset")
    return Repair(component, service=service)


def _driver(component: str, entry: object, find_launch_file: FindLaunchFile) -> Configuration:
    where = f"repairs/{component}/launch"
    if not isinstance(entry, Mapping):
        raise ConfigurationError(f"{where} is {entry!r}: {_FORM}")
    _refuse_unknown(where, entry, _LAUNCH_KEYS)
    file, package = entry.get("file"), entry.get("package", "")
    if not isinstance(file, str) or not file or not isinstance(package, str):
        raise ConfigurationError(f"{where}: 'file' must name a launch file, and 'package' a package: {_FORM}")
    arguments = entry.get("args") or {}
    if not isinstance(arguments, Mapping):
        raise ConfigurationError(f"{where}/args must be of the form {{NAME: VALUE}}")
    args = tuple(_argument(f"{where}/args", str(name), value) for name, value in arguments.items())
    function = FUNCTION.format(component)
    try:
        path = find_launch_file(f"package://{package}/{file}" if package else file, False)
    except ConfigurationError as error:
        return Configuration(function, function, "", args, problem=f"{where}: {error}")
    return Configuration(function, function, path, args)


def _argument(where: str, name: str, value: object) -> str:
    text = str(value).lower() if isinstance(value, bool) else str(value)
    argument = f"{name}:={text}"
    if not isinstance(value, (str, bool, int, float)) or not ARGUMENT.fullmatch(argument):
        raise ConfigurationError(f"{where}/{name} is {value!r}: give a name, and a text, number or truth value")
    return argument


def _refuse_unknown(where: str, entry: Mapping[object, object], known: tuple[str, ...]) -> None:
    unknown = sorted(set(map(str, entry)) - set(known))
    if unknown:
        raise ConfigurationError(f"{where}: unknown key '{unknown[0]}'; known are: {', '.join(known)}")

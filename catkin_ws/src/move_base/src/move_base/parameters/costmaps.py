"""Reads the parameters of one costmap: layers, sources and footprint."""

from __future__ import annotations

import math
import reprlib
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from node_kit.yaml_text import parse_yaml

from move_base.parameters.layout import INFLATION, OBSTACLE, STATIC, VOXEL
from move_base.parameters.parameters import (
    DEFAULT_UPDATE_PERIOD,
    LONGEST,
    LONGEST_TIME,
    OBSTACLE_KINDS,
    CostmapParameters,
    Layer,
    ObservationSource,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from node_kit.parameters import ParameterTree

MAX_CELLS = 50_000_000
"""Cells of a costmap that can be worked with: 350 x 350 m at 0.05 m."""

LAYER_TYPES = {STATIC: "static", OBSTACLE: "obstacle", VOXEL: "voxel", INFLATION: "inflation"}

DATA_TYPES = ("LaserScan", "PointCloud", "PointCloud2")

CIRCLE_CORNERS = 16
"""Corners of the footprint made from `robot_radius`, as in costmap_2d."""

FARTHEST_CORNER = 20.0
"""Corners of a footprint farther from the base than this are a mistake, such as millimetres, m."""

MOST_CORNERS = 1000
"""Corners of a footprint that can be worked with."""

LONGEST_EDGE = 200.0
"""Length of all edges of a footprint that can be worked with, m."""

LONGEST_SHOWN = 200
"""Characters of a footprint in an error."""

LONGEST_TEXT = 60_000
"""Characters of the text of a footprint: it has room for `MOST_CORNERS`."""


def read_costmap(top: ParameterTree, name: str) -> CostmapParameters:
    """Read a costmap of a tree that has been brought into its form by `layout.with_layers`.

    Raises:
        ParameterError: a value can't be used.
    """
    reader = top.child(name)
    levels = (reader, top)
    parameters = CostmapParameters(
        global_frame=frame(reader, "global_frame", "map"),
        robot_base_frame=frame(reader, "robot_base_frame", "base_link"),
        update_frequency=reader.number("update_frequency", 5.0, low=0.0, above=True, high=1000.0),
        publish_frequency=reader.number("publish_frequency", 0.0, low=0.0, high=1000.0),
        transform_tolerance=reader.number("transform_tolerance", 0.3, low=0.0, high=LONGEST_TIME),
        rolling_window=reader.flag("rolling_window", False),
        width=_side(reader, "width"),
        height=_side(reader, "height"),
        resolution=reader.number("resolution", 0.05, low=0.005, high=1.0),
        origin_x=reader.number("origin_x", 0.0, low=-LONGEST, high=LONGEST),
        origin_y=reader.number("origin_y", 0.0, low=-LONGEST, high=LONGEST),
        footprint=_read_footprint(levels),
        robot_radius=_read_radius(levels),
        footprint_padding=reader.number("footprint_padding", 0.01, low=0.0, high=10.0),
        always_send_full_costmap=reader.flag("always_send_full_costmap", False),
        footprint_topic=topic(found(levels, "footprint_topic"), "footprint_topic", ""),
        published_footprint=topic(found(levels, "published_footprint"), "published_footprint", "footprint"),
        layers=(),
    )
    if parameters.width * parameters.height > MAX_CELLS * parameters.resolution**2:
        raise reader.error("resolution", f"gives the costmap over {MAX_CELLS:,} cells", parameters.resolution)
    return replace(parameters, layers=_read_layers(reader, levels))


def found(levels: tuple[ParameterTree, ...], name: str) -> ParameterTree:
    """Return the first of the levels that has the parameter; the first one if none has."""
    return next((level for level in levels if level.has(name)), levels[0])


def frame(reader: ParameterTree, name: str, default: str) -> str:
    """Return a frame's name without the leading slash that some published files have; tf2 refuses it."""
    return reader.text(name, default).removeprefix("/")


def topic(reader: ParameterTree, name: str, default: str) -> str:
    """Return the name of a topic; it may be empty only where the default is.

    Raises:
        ParameterError: it is empty, or names no topic.
    """
    given = reader.text(name, default)
    if not given.strip("/~ ") and (given or default):
        raise reader.error(name, "must be the name of a topic", given)
    return given


def plugin(reader: ParameterTree, where: str, entry: Any, types: Mapping[str, str]) -> tuple[str, str]:
    """Return name and kind of an entry `{name, type}` of a list of plug-ins.

    Raises:
        ParameterError: it has another form, or a type that is not known here.
    """
    if not isinstance(entry, dict) or not isinstance(entry.get("name"), str) or not entry["name"]:
        raise reader.error(where, "must have a name and a type", entry)
    kind = types.get(str(entry.get("type")))
    if kind is None:
        raise reader.error(
            where,
            f"is of an unknown type; known are {', '.join(types)}; the original move_base loads others",
            entry.get("type"),
        )
    return entry["name"], kind


def _side(reader: ParameterTree, name: str) -> float:
    """Return width or height in m: a whole number, to which costmap_2d rounds what is given."""
    given = reader.number(name, 10.0, low=0.0, above=True, high=1000.0)
    return max(1.0, math.floor(given + 0.5))


def _read_layers(reader: ParameterTree, levels: tuple[ParameterTree, ...]) -> tuple[Layer, ...]:
    layers: list[Layer] = []
    for index, entry in enumerate(reader.items("plugins", ())):
        name, kind = plugin(reader, f"plugins[{index}]", entry, LAYER_TYPES)
        if any(layer.name == name for layer in layers):
            raise reader.error(f"plugins[{index}]", "must have another name than the layers before it", name)
        layers.append(_read_layer((reader.child(name), *levels), name, kind))
    return tuple(layers)


def _read_layer(levels: tuple[ParameterTree, ...], name: str, kind: str) -> Layer:
    reader = levels[0]
    layer = Layer(name, kind, reader.flag("enabled", True))
    if kind == "static":
        return replace(
            layer,
            map_topic=topic(reader, "map_topic", "map"),
            track_unknown_space=reader.flag("track_unknown_space", True),
            lethal_cost_threshold=max(0, min(reader.whole("lethal_cost_threshold", 100), 100)),
            unknown_cost_value=reader.whole("unknown_cost_value", -1, low=-128, high=255),
            trinary_costmap=reader.flag("trinary_costmap", True),
            first_map_only=reader.flag("first_map_only", False),
            subscribe_to_updates=reader.flag("subscribe_to_updates", False),
            use_maximum=reader.flag("use_maximum", False),
        )
    if kind == "inflation":
        return replace(
            layer,
            inflation_radius=reader.number("inflation_radius", 0.55, low=0.0, high=50.0),
            cost_scaling_factor=reader.number("cost_scaling_factor", 10.0, low=0.0, high=1e6),
            inflate_unknown=reader.flag("inflate_unknown", False),
        )
    names = dict.fromkeys(reader.text("observation_sources", "").split())
    return replace(
        layer,
        sources=tuple(_read_source(levels, name, source) for source in names),
        footprint_clearing_enabled=reader.flag("footprint_clearing_enabled", True),
        max_obstacle_height=_height(reader, "max_obstacle_height", 2.0),
    )


def _read_source(levels: tuple[ParameterTree, ...], layer: str, name: str) -> ObservationSource:
    reader = levels[0].child(name)
    levels = (reader, *levels)
    period = reader.number("expected_update_rate", 0.0, low=0.0, high=LONGEST_TIME)
    highest = _height(reader, "max_obstacle_height", 2.0)
    source = ObservationSource(
        name=name,
        data_type=reader.choice("data_type", "PointCloud", DATA_TYPES),
        topic=topic(reader, "topic", name),
        sensor_frame=frame(reader, "sensor_frame", ""),
        marking=reader.flag("marking", True),
        clearing=reader.flag("clearing", False),
        min_obstacle_height=_height(reader, "min_obstacle_height", 0.0),
        max_obstacle_height=min(highest, _height(levels[1], "max_obstacle_height", 2.0)),
        obstacle_range=found(levels, "obstacle_range").number("obstacle_range", 2.5, low=0.0, high=LONGEST),
        raytrace_range=found(levels, "raytrace_range").number("raytrace_range", 3.0, low=0.0, high=LONGEST),
        expected_update_rate=period or DEFAULT_UPDATE_PERIOD,
        inf_is_valid=reader.flag("inf_is_valid", False),
        layer=layer,
    )
    if source.min_obstacle_height > highest:
        raise reader.error("min_obstacle_height", "must not be over max_obstacle_height", source.min_obstacle_height)
    return source


def _height(reader: ParameterTree, name: str, default: float) -> float:
    return reader.number(name, default, low=-LONGEST, high=LONGEST)


def _read_radius(levels: tuple[ParameterTree, ...]) -> float:
    reader = found(levels, "robot_radius")
    return reader.number("robot_radius", 0.46, low=0.0, above=True, high=FARTHEST_CORNER)


def _read_footprint(levels: tuple[ParameterTree, ...]) -> tuple[tuple[float, float], ...]:
    reader = found(levels, "footprint")
    value = reader.value("footprint", None)
    if value in (None, "", "[]", []):
        radius = _read_radius(levels)
        angles = np.arange(CIRCLE_CORNERS) * (2.0 * math.pi / CIRCLE_CORNERS)
        return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)
    if isinstance(value, str):
        shown: Any = value if len(value) <= LONGEST_SHOWN else f"{value[:LONGEST_SHOWN]}..."
    else:
        shown = value if len(str(value)) <= LONGEST_SHOWN else reprlib.repr(value)
    if isinstance(value, str) and len(value) > LONGEST_TEXT:
        raise reader.error("footprint", f"must be a text of at most {LONGEST_TEXT:,} characters", shown)
    try:
        corners = np.array(parse_yaml(value) if isinstance(value, str) else value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise reader.error("footprint", "must be a list of [x, y] corners", shown) from error
    if corners.ndim != 2 or corners.shape[0] < 3 or corners.shape[1] != 2 or not np.isfinite(corners).all():
        raise reader.error("footprint", "must be a list of at least three finite [x, y] corners", shown)
    if len(corners) > MOST_CORNERS:
        raise reader.error("footprint", f"must have at most {MOST_CORNERS:,} corners", shown)
    if np.abs(corners).max() > FARTHEST_CORNER:
        rule = f"must have its corners within {FARTHEST_CORNER:g} m of the base along each axis; they are in metres"
        raise reader.error("footprint", rule, shown)
    if np.hypot(*(corners - np.roll(corners, 1, axis=0)).T).sum() > LONGEST_EDGE:
        raise reader.error("footprint", f"must have edges of at most {LONGEST_EDGE:g} m together", shown)
    return tuple((float(x), float(y)) for x, y in corners)


def blind(parameters: CostmapParameters) -> bool:
    """Return whether nothing fills a costmap: it has neither a map nor a sensor."""
    return not any(
        layer.kind == "static" or (layer.kind in OBSTACLE_KINDS and layer.sources) for layer in parameters.layers
    )

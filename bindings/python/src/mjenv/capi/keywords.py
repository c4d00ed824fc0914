"""Gymnasium's keywords for rendering, with render_fast, which is mjenv's, and the keywords of randomisation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict

from mjenv.randomization import Delay, Draws, Noise, Push

RenderMode = Literal["human", "rgb_array", "depth_array", "rgbd_tuple"]
RenderList = Literal["rgb_array_list", "depth_array_list", "rgbd_tuple_list"]
# Whether groups are drawn: {group: bool} for some, or a bool for each of the six.
Groups = Mapping[int, bool] | Sequence[bool]


class Rendering(TypedDict, total=False):
    render_mode: RenderMode | RenderList | None
    width: int
    height: int
    camera_id: int | None
    camera_name: str | None
    max_geom: int
    visual_options: Mapping[int, bool] | None
    render_fast: bool
    geomgroup: Groups | None
    sitegroup: Groups | None
    jointgroup: Groups | None
    tendongroup: Groups | None
    actuatorgroup: Groups | None
    skingroup: Groups | None
    default_camera_config: Mapping[str, Any] | None  # the v4 ids except Swimmer-v4 refuse it


class Randomizing(TypedDict, total=False):
    randomize: Draws | None
    noise: Noise | None
    delay: Delay | None
    push: Push | Sequence[Push] | None


RANDOMIZING = tuple(Randomizing.__annotations__)

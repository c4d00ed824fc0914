"""The named parts of an observation."""

from __future__ import annotations

from typing import Any


def observation_parts(env: Any) -> dict[str, slice]:
    """The place of each part in the observation, by name."""
    return {field.name: slice(field.offset, field.offset + field.count) for field in env.fields("observation")}

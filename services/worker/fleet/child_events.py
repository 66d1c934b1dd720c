"""The lines a render child writes on file descriptor 3, as values."""

import json
from dataclasses import dataclass
from typing import Any

from hi5_common.domain.errors import PermanentError


@dataclass(frozen=True)
class Ready:
    """The child has started and takes up its first image."""


@dataclass(frozen=True)
class ImageRendered:
    """Image and label of an index lie in the output folder, with these SHA-256 (hex)."""

    index: int
    image_sha256: str
    label_sha256: str
    seconds: float
    rss_mb: float


@dataclass(frozen=True)
class ImageRefused:
    """The child could not make an image, and lived to say so."""

    index: int
    reason: str


@dataclass(frozen=True)
class AllDone:
    """The child has done its whole job."""

    images: int


ChildEvent = Ready | ImageRendered | ImageRefused | AllDone


class ProtocolError(PermanentError):
    """The render child wrote a line that no render child writes."""


def parse_event(line: bytes) -> ChildEvent:
    """Read one line. Raises ProtocolError."""
    try:
        return _event(json.loads(line))
    except (ValueError, KeyError, TypeError) as error:
        raise ProtocolError(f"{ProtocolError.__doc__} ({line[:200]!r})") from error


def _event(document: dict[str, Any]) -> ChildEvent:
    match document["event"]:
        case "ready":
            return Ready()
        case "image":
            return ImageRendered(
                index=int(document["index"]),
                image_sha256=str(document["image_sha256"]),
                label_sha256=str(document["label_sha256"]),
                seconds=float(document["seconds"]),
                rss_mb=float(document["rss_mb"]),
            )
        case "failed":
            detail = document.get("detail") or ""
            return ImageRefused(int(document["index"]), f"{document['reason']} {detail}".strip())
        case "done":
            return AllDone(int(document["images"]))
        case other:
            raise ValueError(other)

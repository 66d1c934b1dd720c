"""The lines a render child writes on file descriptor 3, as values."""

import json
from dataclasses import dataclass
from typing import Any

from hi5_common.domain.errors import PermanentError
from hi5_common.domain.faults import ImageFault


@dataclass(frozen=True)
class Ready:
    """The child has started and takes up its first image.

    network: "none", or "open: " and why it could not be, or was not to be, refused one; "unknown"
    of a child that does not say.
    """

    network: str


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
    fault: ImageFault
    detail: str


@dataclass(frozen=True)
class ChildBroken:
    """The child cannot go on, and lived to say why."""

    fault: ImageFault
    detail: str


@dataclass(frozen=True)
class AllDone:
    """The child has done its whole job."""

    images: int


ChildEvent = Ready | ImageRendered | ImageRefused | ChildBroken | AllDone


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
            return Ready(str(document.get("network", "unknown")))
        case "image":
            return ImageRendered(
                index=int(document["index"]),
                image_sha256=str(document["image_sha256"]),
                label_sha256=str(document["label_sha256"]),
                seconds=float(document["seconds"]),
                rss_mb=float(document["rss_mb"]),
            )
        case "failed":
            fault = ImageFault(document["fault"])
            return ImageRefused(int(document["index"]), fault, str(document["detail"]))
        case "broken":
            return ChildBroken(ImageFault(document["fault"]), str(document["detail"]))
        case "done":
            return AllDone(int(document["images"]))
        case other:
            raise ValueError(other)

"""The canary: a known scene that this machine must render right before it may claim a shard.

One 64 × 64 image goes through a render child like any other. Its pixels are held against a
reference of the same renderer within a tolerance, since processors and denoisers round
differently; its label is held against the reference's label, number by number.
"""

import json
import math
import sys
from collections.abc import Callable, Iterator
from importlib.resources import files
from typing import Any

import numpy as np
import numpy.typing as npt

from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.settings import RendererName, Settings
from services.worker.fleet.admission import CanaryDied
from services.worker.fleet.child_records import ChildLedger
from services.worker.fleet.render_process import RenderJob
from services.worker.fleet.scratch import attempt_folder
from services.worker.fleet.shard_render import Limits, ShardRender

LEAST_PSNR_DB = 32.0
"""Between the picture and the reference, over all pixels of 8-bit sRGB."""
MOST_CHANNEL_LEVELS = 3.0
"""How far the mean of a colour channel may lie from the reference's, of 255."""
TOLERANCE = 1e-4
"""How far a number of the label may be off, absolute (pixels, metres) or in proportion."""

REFERENCES = "canary_references"
"""The folder beside this module: a picture by renderer, and the label that they share."""
_COMPARED = ("width_px", "height_px", "attributes", "camera", "keypoints", "box", "hand_box")


def canary_spec() -> DatasetSpec:
    """Return the dataset of the one known image. Its panorama comes with bpy: nothing is baked."""
    return parse_spec(
        {
            "name": "canary",
            "count": 1,
            "seed": 1,
            "image": {"width": 64, "height": 64, "format": "png"},
            "render": {"quality": "draft"},
            "attributes": {"environment": ["city"]},
        }
    )


def fly(settings: Settings, draining: Callable[[], bool]) -> None:
    """Render the known image with a child of this machine and judge it.

    Raises CanaryDied for a wrong image, and what `known_image` raises.
    """
    judge(settings.renderer, *known_image(settings, draining))


def known_image(settings: Settings, draining: Callable[[], bool]) -> tuple[bytes, bytes]:
    """Return picture (PNG) and label (JSON) of the known scene, as this machine makes them.

    Raises AttemptFailed or CanaryDied if there is none, OSError if the scratch folder cannot be
    used, and DrainRequested.
    """
    with attempt_folder(settings.scratch_dir) as folder:
        out_dir = folder / "images"
        out_dir.mkdir()
        render = ShardRender(
            job=RenderJob.of(settings, canary_spec(), (0,), out_dir),
            folder=folder,
            extension="png",
            command=(sys.executable, "-m", settings.child_module),
            limits=Limits.of(settings),
            check=lambda _: None,
            draining=draining,
            ended=ChildLedger(settings.health_dir).add,
        )
        (image,) = render.run()
        if render.draws:
            raise CanaryDied(f"its first draw could not be made: {render.draws[0].reason}")
        return image.image_path.read_bytes(), image.label_path.read_bytes()


def judge(renderer: RendererName, image: bytes, label: bytes) -> None:
    """Raise CanaryDied, with figures, unless image (PNG) and label are the reference's."""
    reference = files("services.worker.fleet").joinpath(REFERENCES)
    expected = json.loads(reference.joinpath("label.json").read_bytes())
    found = {name: value for name, value in json.loads(label).items() if name in _COMPARED}
    for place in _differences("label", expected, found):
        raise CanaryDied(f"the label is wrong: {place}")
    wanted = _pixels(reference.joinpath(f"{renderer.value}.png").read_bytes())
    pixels = _pixels(image)
    if pixels.shape != wanted.shape:
        raise CanaryDied(f"the picture is {pixels.shape}, not {wanted.shape}")
    off = pixels - wanted
    channel = float(np.abs(off.mean(axis=(0, 1))).max())
    error = float((off**2).mean())
    psnr_db = math.inf if error == 0 else 10 * math.log10(255**2 / error)
    if psnr_db < LEAST_PSNR_DB or channel > MOST_CHANNEL_LEVELS:
        raise CanaryDied(
            f"the picture is wrong: {psnr_db:.1f} dB from the reference (at least"
            f" {LEAST_PSNR_DB:g}), a channel's mean {channel:.1f} levels off (at most"
            f" {MOST_CHANNEL_LEVELS:g})"
        )


def compared_part(label: bytes) -> dict[str, Any]:
    """Return what of a label a reference keeps."""
    document = json.loads(label)
    return {name: document[name] for name in _COMPARED}


def _differences(place: str, expected: object, found: object) -> Iterator[str]:
    match expected, found:
        case dict(), dict() if expected.keys() == found.keys():
            for name in expected:
                yield from _differences(f"{place}.{name}", expected[name], found[name])
        case list(), list() if len(expected) == len(found):
            for number, (one, other) in enumerate(zip(expected, found, strict=True)):
                yield from _differences(f"{place}[{number}]", one, other)
        case int() | float(), int() | float():
            if not math.isclose(expected, found, rel_tol=TOLERANCE, abs_tol=TOLERANCE):
                yield f"{place} is {found}, not {expected}"
        case _ if expected != found:
            yield f"{place} is {found!r:.80}, not {expected!r:.80}"


def _pixels(png: bytes) -> npt.NDArray[np.float64]:
    import cv2

    decoded = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    if decoded is None:
        raise CanaryDied("the picture is no PNG file")
    return decoded.astype(np.float64)

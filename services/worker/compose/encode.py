"""Picture files whose bytes depend on the pixels alone: no date, no program name, no threads."""

from collections.abc import Mapping
from types import MappingProxyType

import cv2
import numpy as np
import numpy.typing as npt

from hi5_common.domain.spec import ImageFormat, ImageRequest

EXTENSIONS: Mapping[ImageFormat, str] = MappingProxyType(
    {ImageFormat.JPEG: "jpg", ImageFormat.PNG: "png"}
)


def encode_picture(pixels: npt.NDArray[np.uint8], request: ImageRequest) -> bytes:
    """Return an (H, W, 3) sRGB picture as a file of the format and quality asked for."""
    extension = EXTENSIONS[request.format]
    done, data = cv2.imencode(f".{extension}", pixels[..., ::-1], _parameters(request))
    if not done:
        raise ValueError(f"OpenCV could not encode a {pixels.shape} picture as {extension}.")
    return data.tobytes()


def _parameters(request: ImageRequest) -> list[int]:
    if request.format is ImageFormat.PNG:
        return [
            *(cv2.IMWRITE_PNG_COMPRESSION, 6),
            *(cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_DEFAULT),
        ]
    return [
        *(cv2.IMWRITE_JPEG_QUALITY, request.jpeg_quality),
        *(cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444),
        *(cv2.IMWRITE_JPEG_PROGRESSIVE, 0),
        *(cv2.IMWRITE_JPEG_OPTIMIZE, 0),
    ]

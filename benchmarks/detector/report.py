"""The figures as a table in words and as JSON."""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict

from benchmarks.detector.facing import distance, facing
from benchmarks.detector.score import Judged, Score, Share, by_group, errors_by_keypoint, score
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.vocabulary import KEYPOINTS, Attribute

GROUPS = (
    Attribute.SKIN_TONE,
    Attribute.GENDER,
    Attribute.HANDEDNESS,
    Attribute.VIEWPOINT,
    Attribute.ENVIRONMENT,
    Attribute.POSE,
)
WANTED_FOUND, WANTED_PCK, WANTED_ERROR, WANTED_SIDE = 0.82, 0.95, 0.06, 0.95
WANTED_TONE_GAP = 0.05


def in_words(images: Sequence[Judged]) -> str:
    """Return the figures over all images, then the found share in every group."""
    whole = score(images)
    lines = [
        f"found            {_share(whole.found)}  wanted {WANTED_FOUND:.0%}",
        f"PCK@0.2          {whole.pck:.3f}  wanted {WANTED_PCK}",
        f"mean error       {whole.mean_error:.2%} of the box  wanted {WANTED_ERROR:.0%} or less",
        f"left/right       {_share(whole.side)}  wanted {WANTED_SIDE:.0%}",
        f"tones            {tone_gap(images):.1%} between the best found and the worst",
        f"found elsewhere  {whole.elsewhere}, counted as not found",
    ]
    for name, group_of in _groupings().items():
        lines += ["", f"{name}: found, mean error of those found"]
        lines += _group_lines(images, group_of)
    lines += ["", "mean error by keypoint, % of the box"]
    if whole.found.hits:
        errors = errors_by_keypoint(images)
        pairs = zip(KEYPOINTS, errors, strict=True)
        lines += [f"  {name:18}{100 * error:5.1f}" for name, error in pairs]
    return "\n".join(lines) + "\n"


def as_json(images: Sequence[Judged]) -> dict[str, object]:
    """Return the same as JSON values, with each image's own line."""
    return {
        **_values(score(images)),
        "tone_gap": tone_gap(images),
        "groups": {
            grouping: {
                name: _values(score(group)) for name, group in by_group(images, group_of).items()
            }
            for grouping, group_of in _groupings().items()
        },
        "images": [_image(image) for image in images],
    }


def tone_gap(images: Sequence[Judged]) -> float:
    """Return how far the worst found skin tone is behind the best."""
    groups = by_group(images, _reader(Attribute.SKIN_TONE)).values()
    shares = [score(group).found.value for group in groups]
    return max(shares, default=0.0) - min(shares, default=0.0)


def _groupings() -> dict[str, Callable[[ImageLabel], str]]:
    return {"facing": facing, "distance": distance} | {
        attribute.value: _reader(attribute) for attribute in GROUPS
    }


def _reader(attribute: Attribute) -> Callable[[ImageLabel], str]:
    return lambda label: label.attributes[attribute]


def _group_lines(images: Sequence[Judged], group_of: Callable[[ImageLabel], str]) -> list[str]:
    groups = {name: score(group) for name, group in by_group(images, group_of).items()}
    rows = sorted(groups.items(), key=lambda pair: pair[1].found.value)
    return [f"  {name:24}{_share(of.found)}  {_percent(of.mean_error)}" for name, of in rows]


def _share(share: Share) -> str:
    low, high = share.interval
    return f"{share.value:6.1%} ({share.hits} of {share.of}; 95 %: {low:.1%} to {high:.1%})"


def _percent(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.1%}"


def _values(of: Score) -> dict[str, object]:
    values = asdict(of)
    for name, share in (("found", of.found), ("side", of.side)):
        values[name] |= {"value": share.value, "interval": share.interval}
    return {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in values.items()}


def _image(image: Judged) -> dict[str, object]:
    return {
        "picture": str(image.picture),
        "found": image.is_found,
        "mean_error": float(image.errors.mean()) if image.finding else None,
        "side_agrees": image.side_agrees if image.finding else None,
        "attributes": {key.value: value for key, value in image.label.attributes.items()},
    }

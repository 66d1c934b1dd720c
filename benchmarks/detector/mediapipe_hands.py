"""Run MediaPipe's hand landmarker, everything at its defaults, over pictures.

    python mediapipe_hands.py BUNDLE FOLDER NAME... > findings.json

Runs in the detector's own environment and so imports nothing of hi5. The first hand's 21 points in
pixels, its side and its score, or null where none is found. Since release 0.10.22 of MediaPipe
(and in the landmarker, as measured here, before it) the side is that of the hand in the picture
as it is, not in a mirror.
"""

import json
import sys
from pathlib import Path

import mediapipe
from mediapipe.tasks.python import BaseOptions, vision


def main(bundle: str, folder: str, *names: str) -> None:
    options = vision.HandLandmarkerOptions(base_options=BaseOptions(model_asset_path=bundle))
    findings = {}
    with vision.HandLandmarker.create_from_options(options) as landmarker:
        for name in names:
            image = mediapipe.Image.create_from_file(str(Path(folder) / name))
            findings[name] = first_hand(landmarker.detect(image), image.width, image.height)
    json.dump({"mediapipe": mediapipe.__version__, "findings": findings}, sys.stdout)


def first_hand(result, width_px, height_px):
    if not result.hand_landmarks:
        return None
    side = result.handedness[0][0]
    return {
        "side": side.category_name.lower(),
        "side_score": side.score,
        "points_px": [(p.x * width_px, p.y * height_px) for p in result.hand_landmarks[0]],
    }


if __name__ == "__main__":
    main(*sys.argv[1:])

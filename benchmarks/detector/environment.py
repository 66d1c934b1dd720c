"""The detector's own virtual environment and its two networks, fetched once, pinned by hash.

It is no dependency of hi5: nothing here is imported by it, and its tests run without.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
REQUIREMENTS, MODELS = HERE / "requirements.txt", HERE / "models.txt"
MODEL_PLATFORM = ("--python-version", "3.12", "--python-platform", "x86_64-manylinux_2_28")
NETWORKS = {
    "hand_detector.tflite": "mediapipe/modules/palm_detection/palm_detection_full.tflite",
    "hand_landmarks_detector.tflite": "mediapipe/modules/hand_landmark/hand_landmark_full.tflite",
}
CERTIFICATES = Path("/etc/ssl/certs/ca-certificates.crt")


@dataclass(frozen=True)
class Detector:
    """A Python that has MediaPipe, and the bundle of networks that its hand landmarker reads."""

    python: Path
    bundle: Path

    @property
    def bundle_sha256(self) -> str:
        """Return the hash of the bundle, which is the same on every machine."""
        return hashlib.sha256(self.bundle.read_bytes()).hexdigest()


def open_detector(folder: Path) -> Detector:
    """Return the detector in `folder`, made there first if the locks beside this file changed."""
    detector = Detector(folder / "venv" / "bin" / "python", folder / "hand_landmarker.task")
    wanted = hashlib.sha256(REQUIREMENTS.read_bytes() + MODELS.read_bytes()).hexdigest()
    stamp = folder / "stamp"
    if not stamp.is_file() or stamp.read_text() != wanted:
        folder.mkdir(parents=True, exist_ok=True)
        _make_environment(folder / "venv")
        _make_bundle(folder, detector.bundle)
        stamp.write_text(wanted)
    return detector


def _make_environment(venv: Path) -> None:
    _uv("venv", "--quiet", "--clear", "--python", sys.executable, str(venv))
    python = ("--python", str(venv / "bin" / "python"))
    _uv("pip", "sync", "--quiet", *python, "--require-hashes", str(REQUIREMENTS))


def _make_bundle(folder: Path, bundle: Path) -> None:
    """Zip the two networks, uncompressed and undated, as MediaPipe's own bundle is."""
    wheel = folder / "wheel"
    how = ("--quiet", "--no-deps", "--only-binary", ":all:", "--require-hashes", *MODEL_PLATFORM)
    _uv("pip", "install", *how, "--target", str(wheel), "--requirements", str(MODELS))
    with zipfile.ZipFile(bundle, "w", zipfile.ZIP_STORED) as archive:
        for name, path in NETWORKS.items():
            archive.writestr(zipfile.ZipInfo(name), (wheel / path).read_bytes())
    shutil.rmtree(wheel)


def _uv(*arguments: str) -> None:
    own = ROOT / ".tools" / "uv" / "bin" / "uv"
    uv = shutil.which("uv") or (str(own) if own.is_file() else None)
    if uv is None:
        raise SystemExit("uv is missing: run scripts/setup, or put uv on PATH.")
    trusted = {"UV_SYSTEM_CERTS": "1"} if CERTIFICATES.is_file() else {}
    subprocess.run([uv, *arguments], check=True, env={**trusted, **os.environ})

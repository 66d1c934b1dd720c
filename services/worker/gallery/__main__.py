"""Render the gallery: labelled sheets of poses, tones, shapes, ornaments, places and close-ups.

    python -m services.worker.gallery --out docs/gallery [--only poses] [--resume]

Every picture comes from a fixed seed. Pictures are kept beside the compiled hands until the next
run; --resume takes those that are there instead of rendering them again.
"""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from hi5_common.domain.errors import Hi5Error, InvalidInput, Problem
from hi5_common.domain.spec import Quality
from hi5_common.settings import RendererName, Settings
from services.worker.gallery.photograph import Photographer
from services.worker.gallery.scenes import Sitting
from services.worker.gallery.sections import SECTIONS, Section
from services.worker.gallery.sheet import U1, laid_out, save_jpeg
from services.worker.outcome import write_atomically
from services.worker.studio import open_studio

FAILED, WRONG_INPUT = 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    asked = _parser().parse_args(arguments)
    try:
        names = _names(asked.only)
        asked.out.mkdir(parents=True, exist_ok=True)
        settings = Settings()
        _send_blenders_talk_to(settings.cache_dir)
        studio = open_studio(
            RendererName(asked.renderer),
            asked.threads or settings.render_threads,
            settings.cache_dir,
        )
        photographer = Photographer(studio.renderer, studio.hands, Quality(asked.quality))
        for name in names:
            tiles = settings.cache_dir / "gallery" / name
            _make(SECTIONS[name](), photographer, tiles, asked.out, resume=asked.resume)
    except Hi5Error as error:
        _say(f"error: {error}\n")
        return WRONG_INPUT if isinstance(error, InvalidInput) else FAILED
    return 0


def _make(
    section: Section, photographer: Photographer, tiles: Path, out: Path, *, resume: bool
) -> None:
    started = time.perf_counter()
    tiles.mkdir(parents=True, exist_ok=True)
    taken = []
    for number, sitting in enumerate(section.sittings):
        picture = _tile(photographer, sitting, tiles / f"{number:03d}.png", resume=resume)
        taken.append((sitting.title, picture))
        _say(f"\r{section.name} {number + 1}/{len(section.sittings)} ")
    path = out / f"{section.name}.jpg"
    save_jpeg(laid_out(section.heading, taken, section.columns), path)
    size_kb = path.stat().st_size / 1000.0
    _say(f"{size_kb:.0f} kB, {time.perf_counter() - started:.0f} s\n")


def _tile(photographer: Photographer, sitting: Sitting, path: Path, *, resume: bool) -> U1:
    if resume and path.is_file():
        return _read(path)
    picture = photographer.take(sitting)
    done, data = cv2.imencode(".png", picture[..., ::-1])
    if not done:
        raise ValueError(f"OpenCV could not encode a {picture.shape} picture.")
    write_atomically(path, data.tobytes())
    return picture


def _read(path: Path) -> U1:
    stored = cv2.imread(str(path))
    if stored is None:
        remedy = "It is no picture: delete it, or leave --resume out."
        raise InvalidInput([Problem("--resume", str(path), remedy)])
    return np.ascontiguousarray(stored[..., ::-1], dtype=np.uint8)


def _names(only: str | None) -> list[str]:
    names = [name for name in SECTIONS if only is None or name.startswith(only)]
    if not names:
        remedy = f"Name one of {', '.join(SECTIONS)}, or how some begin."
        raise InvalidInput([Problem("--only", only, remedy)])
    return names


def _send_blenders_talk_to(folder: Path) -> None:
    """Send what libraries write to descriptors 1 and 2 to a file; keep Python's own stderr."""
    folder.mkdir(parents=True, exist_ok=True)
    sys.stderr = os.fdopen(os.dup(2), "w", encoding="utf-8", buffering=1)
    with (folder / "gallery.log").open("wb") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="gallery", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for the sheets")
    parser.add_argument("--only", help=f"only sheets whose name begins so: {', '.join(SECTIONS)}")
    parser.add_argument("--resume", action="store_true", help="take pictures that are there")
    qualities = [quality.value for quality in Quality]
    parser.add_argument("--quality", choices=qualities, default=Quality.HIGH.value)
    renderers = [name.value for name in RendererName]
    parser.add_argument("--renderer", choices=renderers, default=RendererName.CYCLES.value)
    parser.add_argument("--threads", type=int, help="default: the HI5_RENDER_THREADS setting")
    return parser


def _say(text: str) -> None:
    print(text, end="", file=sys.stderr, flush=True)  # noqa: T201  a command's own voice


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    os._exit(code)  # past Blender's own exit, which may crash after the work is done

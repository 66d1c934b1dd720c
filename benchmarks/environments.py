"""The built-in places: bakes them, measures their light, finds the pairs most alike, draws a sheet.

    python benchmarks/environments.py --out out/environments [--width 512] [--only ID ...] [--write]

Prints for each environment its measured mean luminance, its word for light, the brightest texel and
the CPU seconds of its bake (baked once, then read from the cache folder); then the closest pairs by
a thumbnail (RMS of display values, any turn) and by light (spherical harmonics, any turn about the
vertical). `--write` puts the measured luminances into the catalogue.
"""

import argparse
import csv
import io
import itertools
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from hi5_common.domain.environments import CATALOGUE, EnvironmentEntry
from hi5_common.domain.light import light_level
from hi5_common.settings import Settings
from services.worker.places.bakery import WIDTH_PX
from services.worker.places.develop import LUMINANCE, harmonics, mean_rgb
from services.worker.places.exr import read_panorama, write_panorama
from services.worker.places.panoramas import Panoramas
from services.worker.places.recipes import recipe_of

CSV = Path("hi5_common/domain/environments.csv")
THUMB_PX = (256, 128)
TURNS = 16


@dataclass(frozen=True)
class Here:
    """Bakes in this process: Blender starts once for all."""

    threads: int
    width_px: int

    @property
    def name(self) -> str:
        return f"{self.width_px}px"

    def bake(self, entry: EnvironmentEntry, out: Path) -> None:
        from services.worker.render.blender.places import oven

        with tempfile.TemporaryDirectory() as folder:
            scratch = Path(folder) / "shot.exr"
            write_panorama(out, oven.bake(recipe_of(entry), self.width_px, self.threads, scratch))


def shown(panorama: np.ndarray, width_px: int) -> np.ndarray:
    """Return a picture (H, W, 3) u1 of a panorama, exposed for its middle tones."""
    light = cv2.resize(panorama, (width_px, width_px // 2), interpolation=cv2.INTER_AREA)
    grey = light @ LUMINANCE.astype(np.float32)
    light = light * (0.42 / max(float(np.percentile(grey, 70)), 1e-6))
    light = np.where(light < 0.8, light, 0.8 + 0.2 * (1.0 - np.exp(-(light - 0.8) / 0.2)))
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.power(light, 1 / 2.4) - 0.055)
    return np.rint(np.clip(curve, 0.0, 1.0) * 255.0).astype(np.uint8)


def closest(names: list[str], values: list[np.ndarray], many: int = 6) -> list[tuple[float, str]]:
    """Return the pairs with the smallest distance over all turns; values (TURNS, N) each."""
    found = []
    for (a, first), (b, second) in itertools.combinations(enumerate(values), 2):
        gap = float(np.sqrt(((first[:1] - second) ** 2).mean(axis=1)).min())
        found.append((gap, f"{names[a]} / {names[b]}"))
    return sorted(found)[:many]


def turned_thumbnails(panorama: np.ndarray) -> np.ndarray:
    small = cv2.resize(shown(panorama, 64), (32, 16), interpolation=cv2.INTER_AREA) / 255.0
    return np.stack([np.roll(small, step * 2, axis=1).ravel() for step in range(TURNS)])


def turned_harmonics(panorama: np.ndarray) -> np.ndarray:
    small = cv2.resize(panorama, (128, 64), interpolation=cv2.INTER_AREA)
    turns = [harmonics(np.roll(small, step * 8, axis=1)) for step in range(TURNS)]
    return np.stack([turn.ravel() for turn in turns])


def write_luminances(measured: dict[str, float]) -> None:
    rows = list(csv.DictReader(CSV.read_text("utf-8").splitlines()))
    out = io.StringIO()
    writer = csv.DictWriter(out, rows[0].keys(), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        if row["id"] in measured:
            row["luminance"] = f"{measured[row['id']]:.5f}"
        writer.writerow(row)
    CSV.write_text(out.getvalue(), "utf-8")


def sheet(pictures: list[np.ndarray], columns: int) -> np.ndarray:
    blank = np.zeros_like(pictures[0])
    padded = pictures + [blank] * (-len(pictures) % columns)
    rows = [np.hstack(padded[i : i + columns]) for i in range(0, len(padded), columns)]
    return np.vstack(rows)


def captioned(panorama: np.ndarray, name: str) -> np.ndarray:
    picture = np.ascontiguousarray(shown(panorama, THUMB_PX[0])[..., ::-1])
    for colour, width in (((0, 0, 0), 3), ((255, 255, 255), 1)):
        cv2.putText(picture, name, (4, 122), cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, width)
    return picture


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--width", type=int, default=WIDTH_PX)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--columns", type=int, default=8)
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    settings = Settings()
    baker = Here(settings.render_threads, asked.width)
    places = Panoramas(settings.cache_dir, settings.resolved_assets_dir, baker)
    names = asked.only or list(CATALOGUE)
    measured: dict[str, float] = {}
    pictures, thumbs, lights = [], [], []
    for name in names:
        started = time.process_time()
        path = places.path(name)
        cpu_s = time.process_time() - started
        panorama = read_panorama(path)
        measured[name] = float(mean_rgb(panorama) @ LUMINANCE)
        word = light_level(measured[name]).value
        print(f"{name:22} {measured[name]:8.5f} {word:9} peak {panorama.max():9.1f} {cpu_s:6.2f} s")
        pictures.append(captioned(panorama, name))
        thumbs.append(turned_thumbnails(panorama))
        lights.append(turned_harmonics(panorama))
    asked.out.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(asked.out / "sheet.jpg"), sheet(pictures, asked.columns))
    for what, values in (("thumbnail", thumbs), ("light", lights)):
        for gap, pair in closest(names, values):
            print(f"closest by {what}: {gap:.4f}  {pair}")
    words = [light_level(value).value for value in measured.values()]
    print({word: words.count(word) for word in sorted(set(words))}, len(words), "environments")
    if asked.write:
        write_luminances(measured)


if __name__ == "__main__":
    main()

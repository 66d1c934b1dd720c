"""What `hi5 assets` runs: lists, bakes, takes in and fetches panoramas, a line of output each."""

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from hi5_common.domain.environments import CATALOGUE, EnvironmentEntry, EnvironmentKind
from hi5_common.domain.errors import Hi5Error, InvalidInput, Problem, TransientError
from hi5_common.domain.light import light_level
from hi5_common.own_places import OwnPanorama, list_own
from hi5_common.settings import Settings
from services.worker.places.bakery import Oven, baked_panorama
from services.worker.places.intake import Terms, add_folder
from services.worker.places.polyhaven import RESOLUTIONS, PolyHaven

FAILED, WRONG_INPUT, UNREACHABLE = 1, 2, 3


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; return its exit code."""
    asked = _parser().parse_args(arguments)
    try:
        for line in asked.run(asked, Settings()):
            print(line, flush=True)  # noqa: T201  a command's own voice
    except Hi5Error as error:
        print(f"error: {error}", file=sys.stderr)  # noqa: T201
        if isinstance(error, InvalidInput):
            return WRONG_INPUT
        return UNREACHABLE if isinstance(error, TransientError) else FAILED
    return 0


def bake(asked: argparse.Namespace, settings: Settings) -> Iterator[str]:
    """Bake the environments named, or every generated one."""
    generated = {name: entry for name, entry in CATALOGUE.items() if entry.recipe}
    unknown = [name for name in asked.ids if name not in generated]
    if unknown:
        remedy = "Name generated environments as `hi5 assets list` prints them."
        raise InvalidInput([Problem("ID", name, remedy) for name in unknown])
    oven = Oven(settings.render_threads)
    for name in asked.ids or generated:
        started = time.perf_counter()
        path = baked_panorama(generated[name], settings.cache_dir, oven)
        seconds = round(time.perf_counter() - started, 2)
        yield json.dumps({"id": name, "file": str(path), "seconds": seconds})


def add(asked: argparse.Namespace, settings: Settings) -> Iterator[str]:
    """Take in the panoramas of a folder."""
    terms = Terms(EnvironmentKind(asked.kind), asked.licence, asked.author)
    for panorama in add_folder(asked.folder, settings.resolved_assets_dir, terms):
        yield _described(panorama)


def fetch(asked: argparse.Namespace, settings: Settings) -> Iterator[str]:
    """Fetch panoramas from Poly Haven."""
    if not asked.ids and not asked.popular:
        remedy = "Name ids of polyhaven.com/hdris, or ask for --popular N."
        raise InvalidInput([Problem("ID", "", remedy)])
    with PolyHaven(settings.polyhaven_url) as source:
        for name in [*asked.ids, *(source.popular(asked.popular) if asked.popular else [])]:
            yield _described(source.fetch(name, asked.resolution, settings.resolved_assets_dir))


def listed(asked: argparse.Namespace, settings: Settings) -> Iterator[str]:
    """List every environment that this machine can light a hand with."""
    own = [panorama.entry for panorama in list_own(settings.resolved_assets_dir)]
    for entry in (*CATALOGUE.values(), *own):
        if asked.json:
            yield json.dumps({**entry_words(entry), "light": light_level(entry.luminance).value})
            continue
        light = light_level(entry.luminance).value
        yield f"{entry.id:<20} {entry.kind.value:<8} {light:<9} {entry.licence:<8} {entry.title}"


def entry_words(entry: EnvironmentEntry) -> dict[str, object]:
    """Return what is told of an environment."""
    return {
        "id": entry.id,
        "title": entry.title,
        "kind": entry.kind.value,
        "origin": entry.origin.value,
        "source": entry.source,
        "author": entry.author,
        "licence": entry.licence,
        "luminance": entry.luminance,
    }


def _described(panorama: OwnPanorama) -> str:
    size = {"width_px": panorama.width_px, "sha256": panorama.sha256}
    return json.dumps({**entry_words(panorama.entry), **size})


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="assets", description=(__doc__ or "").split("\n")[0])
    commands = parser.add_subparsers(required=True)
    listing = commands.add_parser("list")
    listing.add_argument("--json", action="store_true")
    listing.set_defaults(run=listed)
    baking = commands.add_parser("bake")
    baking.add_argument("ids", nargs="*")
    baking.set_defaults(run=bake)
    adding = commands.add_parser("add")
    adding.add_argument("folder", type=Path)
    adding.add_argument("--kind", choices=[kind.value for kind in EnvironmentKind], required=True)
    adding.add_argument("--licence", default="unknown")
    adding.add_argument("--author", default="unknown")
    adding.set_defaults(run=add)
    fetching = commands.add_parser("fetch")
    fetching.add_argument("ids", nargs="*")
    fetching.add_argument("--popular", type=int, default=0)
    fetching.add_argument("--resolution", choices=RESOLUTIONS, default="2k")
    fetching.set_defaults(run=fetch)
    return parser


if __name__ == "__main__":
    sys.exit(main())

"""Rooms people live in: living rooms, bedrooms, kitchens, studies, bathrooms."""

import numpy as np

from services.worker.places import decor as d
from services.worker.places import furniture as f
from services.worker.places import rooms as r
from services.worker.places import windows as w
from services.worker.places.furnishing import CLOTHS, Room
from services.worker.places.place import Finish, Pattern, Place
from services.worker.places.shapes import box, boxes


def living(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return a living room: sofas, low table, shelves, pictures, plants, standing lamps."""
    room = Room(rng, (rng.uniform(5.2, 6.6), rng.uniform(4.2, 5.2), 2.6), light, variant, variant)
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    curtain = room.cloth()
    room.fit(w.window("x1", s, y * 0.5, 2.4, room.day, curtain=curtain, panes=3))
    room.fit(w.window("y0", s, x * 0.22, 1.3, room.day, curtain=curtain))
    room.fit(d.radiator("x1", s, y * 0.5, 1.8), d.radiator("y0", s, x * 0.22, 1.0))
    room.fit(r.door("x0", s, y * 0.17, r.WHITE), d.sideboard("x0", s, y * 0.62, 1.7, rng))
    room.fit(d.gallery("x0", s, y * 0.38, y * 0.88, rng), d.gallery("y1", s, 0.7, x * 0.7, rng))
    room.fit(d.wall_shelf("y1", s, x * 0.82, 1.5, 1.0, rng), d.clock("x0", s, y * 0.30, 2.0))
    cover = room.cloth()
    room.put(f.rug(CLOTHS[variant % 7], 2.6, 1.8), x * 0.45, y * 0.55)
    room.put(f.sofa(cover, 3, rng), x * 0.42, y - 0.55, 180.0)
    room.put(f.sofa(cover, 1, rng), x * 0.80, y * 0.6, 90.0)
    room.put(f.table(room.wood(), 1.1, 0.6, 0.4), x * 0.42, y * 0.52)
    room.put(f.shelf(room.wood(), 1.8, 2.0, rng), x * 0.66, 0.31)
    room.fit(r.plant(x - 0.45, 0.5, 0.0, 1.3, rng), r.plant(0.4, y - 0.4, 0.0, 1.1, rng))
    if room.lit:
        room.fit(r.floor_lamp(x * 0.42 - 1.5, y - 0.4, room.glow(2.0)))
        room.fit(r.table_lamp(0.22, y * 0.62 - 0.75, 0.83, room.glow(2.0)))
        room.fit(r.pendant(x * 0.42, y * 0.52, s, 0.7, room.glow(1.6)))
    return room.place(x * 0.52, y * 0.36)


def bedroom(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return a bedroom: bed, wardrobe, night tables with lamps, window with curtains."""
    room = Room(
        rng, (rng.uniform(3.8, 4.8), rng.uniform(3.6, 4.4), 2.5), light, variant + 5, variant + 3
    )
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    room.fit(w.window("x1", s, y * 0.45, 2.0, room.day, curtain=room.cloth(), panes=3))
    room.fit(d.radiator("x1", s, y * 0.45, 1.4), d.gallery("x0", s, 1.6, y - 0.5, rng))
    room.fit(r.door("x0", s, 0.8, r.WHITE), d.picture("y1", s, x * 0.5, 1.65, (1.2, 0.6), rng))
    room.fit(d.coats("x1", s, y - 0.6, rng), d.sideboard("x0", s, y * 0.62, 1.2, rng))
    wood = room.wood()
    room.put(f.bed(wood, room.cloth(), rng), x * 0.5, y - 1.1, 180.0)
    room.put(f.wardrobe(r.WHITE if variant % 2 else wood, 1.5), x * 0.28, 0.57)
    room.fit(w.window("y0", s, x * 0.72, 1.1, room.day, curtain=room.cloth()))
    for side in (-1.0, 1.0):
        at = x * 0.5 + side * 1.15
        room.put([box(wood, (-0.22, -0.2, 0.0), (0.22, 0.2, 0.5))], at, y - 0.22)
        if room.lit:
            room.fit(r.table_lamp(at, y - 0.22, 0.5, room.glow(2.4)))
    room.put(f.rug(CLOTHS[(variant + 2) % 7], 1.7, 1.1), x * 0.4, y * 0.32)
    room.fit(r.plant(x - 0.4, 0.4, 0.0, 1.1, rng))
    if light in ("soft", "warm"):
        room.fit(r.pendant(x * 0.5, y * 0.5, s, 0.5, room.glow(1.6)))
    return room.place(x * 0.42, y * 0.40)


def kitchen(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return a kitchen: line of cupboards, table with chairs, window over the worktop."""
    room = Room(
        rng, (rng.uniform(4.2, 5.4), rng.uniform(3.4, 4.2), 2.55), light, variant + 3, variant * 3
    )
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    front = (r.WHITE, Finish(Pattern.PLAIN, (0.09, 0.16, 0.18), roughness=0.45), r.PINE, r.OAK)[
        variant % 4
    ]
    room.put(f.kitchen(front, x * 0.8, rng), x * 0.45, 0.61)
    room.put([box(r.STEEL, (-0.32, -0.3, 0.0), (0.32, 0.3, 1.8))], x - 0.34, 0.35)
    room.fit(w.window("x1", s, y * 0.62, 1.7, room.day), w.window("y1", s, x * 0.3, 1.4, room.day))
    room.fit(r.door("x0", s, y * 0.78, r.WHITE), d.gallery("y1", s, x * 0.52, x * 0.9, rng))
    room.fit(d.wall_shelf("x0", s, y * 0.45, 1.45, 1.1, rng), d.clock("x0", s, y * 0.45, 2.05))
    room.fit(d.wall_shelf("x0", s, y * 0.45, 1.05, 1.1, rng), d.radiator("y1", s, x * 0.3, 1.0))
    room.put(f.rug(CLOTHS[(variant + 4) % 7], 1.9, 1.0), x * 0.4, y * 0.42)
    wood, seat = room.wood(), room.cloth()
    room.put(f.table(wood, 1.4, 0.85), x * 0.62, y - 1.0)
    for dx, dy, turn in ((-0.4, -0.65, 0), (0.4, -0.65, 0), (-0.4, 0.6, 180), (0.4, 0.6, 180)):
        room.put(f.chair(wood, seat), x * 0.62 + dx, y - 1.0 + dy, turn + rng.uniform(-12, 12))
    room.fit(r.plant(x - 0.3, y - 0.3, 0.9, 0.5, rng))
    if room.lit:
        room.fit(r.pendant(x * 0.62, y - 1.0, s, 0.9, room.glow(2.4)))
        room.fit(r.ceiling_panel(x * 0.35, y * 0.4, s, (0.5, 0.5), room.glow(2.0)))
    return room.place(x * 0.30, y * 0.50)


def study(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return a small study or library: walls of books, a desk, one good lamp."""
    room = Room(
        rng, (rng.uniform(3.6, 5.2), rng.uniform(3.2, 4.2), 2.7), light, variant + 1, variant + 6
    )
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    wood = room.wood()
    for at in np.arange(0.7, x - 0.5, 1.22):
        room.put(f.shelf(wood, 1.2, 2.2, rng, full=0.93), float(at), 0.31)
    for at in np.arange(0.7, y - 0.5, 1.22):
        room.put(f.shelf(wood, 1.2, 2.2, rng, full=0.93), 0.31, float(at), -90.0)
    room.fit(w.window("x1", s, y * 0.55, 1.9, room.day, curtain=room.cloth(), panes=3))
    room.fit(w.window("y1", s, x * 0.28, 1.0, room.day, curtain=room.cloth()))
    room.fit(d.pinboard("y1", s, x * 0.72, 1.3, rng), d.radiator("x1", s, y * 0.55, 1.2))
    room.put(f.desk(wood, rng), x * 0.68, y - 0.75)
    room.put(f.office_chair(f.cloth((0.06, 0.035, 0.025))), x * 0.68, y - 1.45, 20.0)
    room.put(f.rug(CLOTHS[(variant + 3) % 7], 2.2, 1.5), x * 0.5, y * 0.5)
    room.fit(r.plant(x - 0.4, 0.5, 0.0, 1.2, rng))
    if room.lit:
        room.fit(r.table_lamp(x * 0.68 - 0.55, y - 0.6, 0.74, room.glow(3.0)))
        room.fit(r.floor_lamp(x - 0.5, y * 0.3, room.glow(2.0)))
    return room.place(x * 0.55, y * 0.42)


def bathroom(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return a tiled bathroom: bath, basin, mirror, towels."""
    room = Room(
        rng, (rng.uniform(2.8, 3.6), rng.uniform(2.4, 3.0), 2.45), light, (3, 4)[variant % 2], 8
    )
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    rgb = ((0.36, 0.56, 0.64), (0.10, 0.34, 0.34), (0.62, 0.57, 0.5))[variant % 3]
    tiles = Finish(Pattern.TILES, rgb, (0.42, 0.42, 0.41), 0.15, 0.15)
    t = 0.012
    room.put(
        [
            boxes(
                tiles,
                [
                    ((0, 0, 0), (x, t, 1.9)),
                    ((0, y - t, 0), (x, y, 1.9)),
                    ((0, 0, 0), (t, y, 1.9)),
                    ((x - t, 0, 0), (x, y, 1.9)),
                ],
            )
        ],
        0.0,
        0.0,
    )
    room.put(f.bath(rng), x * 0.5, y - 0.42, 180.0)
    glaze = Finish(Pattern.PLAIN, (0.75, 0.75, 0.74), roughness=0.15)
    room.put(
        [
            box(r.OAK, (-0.6, -0.25, 0.25), (0.6, 0.25, 0.8)),
            box(glaze, (-0.62, -0.26, 0.8), (0.62, 0.26, 0.88)),
        ],
        x * 0.5,
        0.28,
    )
    mirror = Finish(Pattern.PLAIN, (0.85, 0.85, 0.85), roughness=0.02, metallic=1.0)
    room.put([box(mirror, (-0.55, -0.01, 1.1), (0.55, 0.0, 1.9))], x * 0.5, 0.03)
    room.fit(w.window("x1", s, y * 0.55, 1.2, room.day, heights_m=(1.1, 2.2)))
    room.fit(d.wall_shelf("x0", s, y * 0.75, 1.4, 0.8, rng), d.coats("x1", s, y * 0.16, rng))
    room.fit(d.picture("y1", s, x * 0.3, 1.6, (0.5, 0.6), rng))
    room.put(f.rug(CLOTHS[(variant + 3) % 7], 1.0, 0.6), x * 0.5, 1.0)
    room.put(f.stool(r.PINE, room.cloth()), x * 0.2, y * 0.45)
    room.fit(
        r.ceiling_panel(
            x * 0.5, y * 0.5, s, (0.5, 0.5), room.glow(2.5) if room.lit else r.times(r.SOFT, 1.0)
        )
    )
    room.fit(r.plant(x - 0.3, 0.3, 0.0, 0.9, rng), r.door("x0", s, y * 0.4, r.WHITE))
    return room.place(x * 0.45, y * 0.45)

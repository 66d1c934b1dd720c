"""Rooms people work and meet in: offices, corridors, cafes, workshops, classrooms."""

import numpy as np

from services.worker.places import decor as d
from services.worker.places import furniture as f
from services.worker.places import rooms as r
from services.worker.places import windows as w
from services.worker.places.furnishing import CLOTHS, Room
from services.worker.places.place import Finish, Pattern, Place
from services.worker.places.shapes import box


def office(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return an open office: rows of desks with screens, ceiling panels, a long window."""
    room = Room(
        rng,
        (rng.uniform(8.0, 11.0), rng.uniform(6.0, 8.0), 2.8),
        light,
        (5, 6, 7, 0)[variant % 4],
        8 - variant,
    )
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    for number in range(3):
        room.fit(w.window("y1", s, x * (0.2 + 0.3 * number), 2.3, room.day, panes=3))
    room.fit(r.door("x0", s, y * 0.2, r.OAK), d.pinboard("x0", s, y * 0.6, 2.4, rng))
    room.fit(d.lockers("x0", s, y * 0.82, y * 0.98, (0.10, 0.22, 0.30)))
    room.fit(w.window("x1", s, y * 0.5, 2.4, room.day, panes=3), d.clock("x0", s, y * 0.36, 2.2))
    room.fit(
        d.gallery("y0", s, x * 0.12, x * 0.42, rng), d.wall_shelf("y0", s, x * 0.84, 1.5, 1.6, rng)
    )
    room.put(f.rug(CLOTHS[(variant + 1) % 7], 3.0, 2.0), x * 0.46, y * 0.5)
    screen = (0.25, 0.32, 0.45)
    for column in range(3):
        for row in range(2):
            at_x, at_y = x * (0.22 + 0.28 * column), y * (0.3 + 0.42 * row)
            room.put(f.desk(r.WHITE if variant % 2 else r.OAK, rng, screen=screen), at_x, at_y)
            room.put(
                f.office_chair(room.cloth()),
                at_x + rng.uniform(-0.2, 0.2),
                at_y - 0.75,
                rng.uniform(-40, 40),
            )
    room.put(f.shelf(r.WHITE, 2.4, 1.8, rng, full=0.7), x * 0.6, 0.31)
    room.fit(r.plant(0.5, y - 0.5, 0.0, 1.4, rng), r.plant(x - 0.5, 0.5, 0.0, 1.4, rng))
    power = room.glow(1.5) if room.lit else r.times(r.COLD, 1.5)
    for column in range(4):
        for row in range(2):
            room.fit(
                r.ceiling_panel(
                    x * (0.16 + 0.23 * column), y * (0.27 + 0.45 * row), s, (1.2, 0.3), power
                )
            )
    return room.place(x * 0.46, y * 0.52)


def corridor(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return a long corridor with doors, ceiling lamps and a window at its end."""
    room = Room(
        rng,
        (rng.uniform(12.0, 20.0), rng.uniform(1.9, 2.8), 2.6),
        light,
        (5, 3, 7)[variant % 3],
        variant * 2,
    )
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    leaf = (r.OAK, r.WHITE, Finish(Pattern.PLAIN, (0.08, 0.13, 0.2), roughness=0.4))[variant % 3]
    room.fit(
        d.wainscot(
            s, ((0.16, 0.30, 0.34), (0.50, 0.42, 0.12), (0.30, 0.10, 0.07))[variant % 3], 1.0
        )
    )
    for number, at in enumerate(np.arange(1.5, x - 1.0, 2.9)):
        room.fit(r.door("y0" if number % 2 else "y1", s, float(at), leaf))
        facing = "y1" if number % 2 else "y0"
        if variant % 3 == 2:
            room.fit(d.gallery(facing, s, float(at) - 0.7, float(at) + 0.7, rng))
            room.fit(d.wall_lamp(facing, s, float(at) + 1.3, 1.75, room.glow(2.0)))
        elif number % 3 == 1:
            room.fit(d.pinboard(facing, s, float(at), 1.4, rng))
        elif variant % 3 == 1:
            room.fit(d.lockers(facing, s, float(at) - 0.9, float(at) + 0.9, (0.42, 0.12, 0.06)))
            room.fit(w.window(facing, s, float(at) + 1.6, 0.9, room.day))
        else:
            room.fit(d.gallery(facing, s, float(at) - 0.7, float(at) + 0.7, rng))
        power = room.glow(2.2) if room.lit else r.times(r.COLD, 2.6)
        room.fit(r.ceiling_panel(float(at) + 0.7, y / 2.0, s, (0.6, 0.3), power))
    room.fit(w.window("x1", s, y / 2.0, min(1.4, y - 0.4), room.day))
    room.fit(r.plant(x - 0.4, 0.35, 0.0, 1.2, rng))
    room.put(f.sofa(room.cloth(), 2, rng), x * 0.35 + 1.5, y - 0.45, 180.0)
    return room.place(x * 0.42, y * 0.42)


def cafe(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return a cafe: small tables, hanging lamps, a counter with bottles, large windows."""
    room = Room(
        rng,
        (rng.uniform(7.0, 10.0), rng.uniform(5.0, 7.0), 3.1),
        light,
        (1, 8, 4, 0)[variant % 4],
        (7, 3, 5, 9)[variant % 4],
    )
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    for number in range(2):
        room.fit(
            w.window(
                "x1", s, y * (0.27 + 0.46 * number), 2.0, room.day, heights_m=(0.5, 2.7), panes=3
            )
        )
    room.fit(w.window("y1", s, x * 0.55, 2.0, room.day, heights_m=(0.7, 2.7), panes=3))
    room.fit(d.wainscot(s, r.WALLS[(variant * 3 + 4) % 10], 0.95), d.clock("x0", s, y * 0.5, 2.3))
    room.fit(
        d.gallery("x0", s, y * 0.3, y * 0.9, rng), d.wall_shelf("y0", s, x * 0.66, 1.7, 1.8, rng)
    )
    wood, seat = room.wood(), room.cloth()
    room.put(
        [
            box(wood, (-1.8, -0.3, 0.0), (1.8, 0.3, 1.05)),
            box(r.MARBLE, (-1.85, -0.35, 1.05), (1.85, 0.35, 1.09)),
        ],
        2.4,
        1.5,
    )
    room.put(f.shelf(wood, 3.4, 2.2, rng, full=0.55), 2.4, 0.31)
    for column in range(3):
        for row in range(2):
            at_x, at_y = x * (0.42 + 0.2 * column), y * (0.42 + 0.36 * row)
            room.put(f.table(wood, 0.75, 0.75), at_x, at_y)
            room.put(f.chair(r.BLACK, seat), at_x, at_y - 0.62, rng.uniform(-15, 15))
            room.put(f.chair(r.BLACK, seat), at_x, at_y + 0.62, 180.0 + rng.uniform(-15, 15))
            if room.lit or variant % 2:
                tone = room.glow(1.5) if room.lit else r.times(r.WARM, 2.0)
                room.fit(r.pendant(at_x, at_y, s, 1.2, tone))
    room.fit(
        d.picture("y1", s, x * 0.22, 1.7, (1.2, 0.8), rng),
        d.picture("y1", s, x * 0.82, 1.7, (0.6, 0.8), rng),
    )
    room.fit(r.plant(x - 0.5, 0.5, 0.0, 1.6, rng), r.plant(0.5, y - 0.5, 0.0, 1.4, rng))
    return room.place(x * 0.34, y * 0.60)


def workshop(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return a garage or workshop: concrete, workbench, steel shelves, boxes, strip lamps."""
    room = Room(
        rng, (rng.uniform(5.5, 8.0), rng.uniform(4.5, 6.0), 3.0), light, 7, (0, 8, 2)[variant % 3]
    )
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    paint = ((0.10, 0.24, 0.34), (0.40, 0.10, 0.05), (0.12, 0.26, 0.14))[variant % 3]
    room.fit(d.wainscot(s, paint, 1.15), d.lockers("x0", s, y * 0.72, y - 0.15, paint))
    room.fit(d.wall_shelf("x1", s, y * 0.8, 1.7, 1.2, rng), d.pinboard("y0", s, x * 0.66, 1.2, rng))
    room.put(f.table(r.PINE, 2.6, 0.8, 0.9), x * 0.4, y - 0.45)
    room.put(f.shelf(r.STEEL, 2.0, 2.1, rng, full=0.35), x * 0.35, 0.31)
    room.put(f.shelf(r.STEEL, 2.0, 2.1, rng, full=0.35), 0.31, y * 0.5, -90.0)
    room.put(f.crates(rng, 9), x * 0.75, 0.7)
    room.put(f.crates(rng, 6), x - 0.7, y * 0.8)
    board = Finish(Pattern.MOTTLED, (0.30, 0.20, 0.11), (0.36, 0.25, 0.15), 0.05, 0.9)
    room.put([box(board, (-1.2, -0.02, 1.2), (1.2, 0.0, 2.1))], x * 0.4, y - 0.02)
    tools = [
        box(
            (r.STEEL, r.BLACK)[n % 2],
            (-1.1 + 0.2 * n, -0.05, 1.35),
            (-1.06 + 0.2 * n + 0.03 * (n % 3), -0.02, 1.6 + 0.12 * (n % 4)),
        )
        for n in range(11)
    ]
    room.put(tools, x * 0.4, y - 0.02)
    room.fit(
        w.window("x1", s, y * 0.4, 1.6, room.day, heights_m=(1.1, 2.25)),
        r.door("y0", s, x * 0.88, r.PINE),
        w.window("y1", s, x * 0.8, 1.4, room.day, heights_m=(1.1, 2.25)),
        d.clock("y0", s, x * 0.66, 2.35),
    )
    power = room.glow(2.8) if room.lit else r.times(r.COLD, 1.4)
    for row in range(2):
        room.fit(r.ceiling_panel(x * 0.5, y * (0.3 + 0.4 * row), s, (1.5, 0.15), power))
    return room.place(x * 0.55, y * 0.5)


def classroom(rng: np.random.Generator, light: str, variant: int) -> Place:
    """Return a classroom or meeting room: tables, chairs, a board, a row of windows."""
    room = Room(
        rng,
        (rng.uniform(7.5, 9.5), rng.uniform(6.0, 7.5), 3.0),
        light,
        (0, 5, 3)[variant % 3],
        (0, 3, 6)[variant % 3],
    )
    s, x, y = room.shell, room.shell.length_m, room.shell.width_m
    for number in range(3):
        room.fit(w.window("y0", s, x * (0.2 + 0.3 * number), 1.9, room.day, heights_m=(0.85, 2.6)))
    board = Finish(Pattern.MOTTLED, (0.03, 0.07, 0.05), (0.06, 0.11, 0.085), 0.5, 0.6)
    if variant % 2:
        board = Finish(Pattern.PLAIN, (0.75, 0.75, 0.75), roughness=0.2)
    room.put(
        [
            box(r.OAK, (-0.01, -1.9, 0.85), (0.03, 1.9, 2.15)),
            box(board, (0.0, -1.85, 0.9), (0.04, 1.85, 2.1)),
        ],
        0.0,
        y / 2.0,
    )
    seat = room.cloth()
    for column in range(3):
        for row in range(3):
            at_x, at_y = x * (0.34 + 0.22 * column), y * (0.2 + 0.3 * row)
            room.put(f.table(r.PINE, 0.7, 1.3), at_x, at_y)
            for side in (-0.3, 0.3):
                room.put(
                    f.chair(r.STEEL, seat), at_x + 0.55, at_y + side, 90.0 + rng.uniform(-15, 15)
                )
    room.fit(r.door("x0", s, y - 0.6, r.OAK), r.plant(x - 0.4, y - 0.4, 0.0, 1.2, rng))
    room.fit(d.pinboard("y1", s, x * 0.26, 2.2, rng), d.pinboard("y1", s, x * 0.62, 1.8, rng))
    room.fit(d.picture("y1", s, x * 0.82, 1.6, (0.8, 1.0), rng), d.clock("x0", s, y * 0.5, 2.4))
    room.fit(d.sideboard("y1", s, x * 0.26, 2.0, rng), d.sideboard("y1", s, x * 0.62, 1.6, rng))
    room.fit(w.window("x1", s, y * 0.35, 1.8, room.day), d.gallery("x1", s, y * 0.58, y * 0.9, rng))
    power = room.glow(1.8) if room.lit else r.times(r.COLD, 1.2)
    for column in range(3):
        for row in range(2):
            room.fit(
                r.ceiling_panel(
                    x * (0.2 + 0.3 * column), y * (0.3 + 0.4 * row), s, (1.2, 0.3), power
                )
            )
    return room.place(x * 0.24, y * 0.5)

"""The bones of the hand: names, parents, the rig bones they take their skin weights from."""

from dataclasses import dataclass

from services.worker.hand.parts import HandPart

FINGERS = ("index", "middle", "ring", "pinky")
"""The four fingers; the asset rig numbers them 2 to 5 and the thumb 1."""

FOREARM_TWISTS = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Share of the pronation that each forearm bone takes, elbow to wrist."""


@dataclass(frozen=True)
class Bone:
    """One bone: its parent, its end joints in the asset, the asset's weights it gathers."""

    name: str
    parent: str | None
    head_joint: str
    tail_joint: str
    weight_groups: tuple[str, ...]
    part: HandPart


def _forearm_bones() -> list[Bone]:
    names = ["forearm", *(f"forearm_twist_{i}" for i in range(1, len(FOREARM_TWISTS)))]
    parents = [None, *names[:-1]]
    return [
        Bone(name, parent, "joint-r-elbow", "joint-r-hand", (), HandPart.FOREARM)
        for name, parent in zip(names, parents, strict=True)
    ]


def _thumb_bones() -> list[Bone]:
    names = ("thumb_metacarpal", "thumb_proximal", "thumb_distal")
    parents = ("hand", *names[:-1])
    return [_phalanx(1, i, *pair) for i, pair in enumerate(zip(names, parents, strict=True), 1)]


def _phalanx(finger: int, segment: int, name: str, parent: str) -> Bone:
    head, tail = (f"joint-r-finger-{finger}-{end}" for end in (segment, segment + 1))
    return Bone(name, parent, head, tail, (f"finger{finger}-{segment}.R",), HandPart(name))


def _finger_bones(number: int, finger: str) -> list[Bone]:
    root = "joint-r-hand-3" if number < 4 else "joint-r-hand-2"
    metacarpal = Bone(
        f"{finger}_metacarpal",
        "hand",
        root,
        f"joint-r-finger-{number}-1",
        (f"metacarpal{number - 1}.R",),
        HandPart.PALM,
    )
    names = [f"{finger}_{segment}" for segment in ("proximal", "middle", "distal")]
    parents = [metacarpal.name, *names[:-1]]
    pairs = zip(names, parents, strict=True)
    return [metacarpal, *(_phalanx(number, i, *pair) for i, pair in enumerate(pairs, 1))]


def _all_bones() -> tuple[Bone, ...]:
    hand = Bone(
        "hand", "forearm_twist_3", "joint-r-hand", "joint-r-hand-3", ("wrist.R",), HandPart.PALM
    )
    fingers = (_finger_bones(number, finger) for number, finger in enumerate(FINGERS, 2))
    return (*_forearm_bones(), hand, *_thumb_bones(), *(b for bones in fingers for b in bones))


BONES: tuple[Bone, ...] = _all_bones()
BONE_NAMES: tuple[str, ...] = tuple(bone.name for bone in BONES)
BONE_INDEX: dict[str, int] = {name: index for index, name in enumerate(BONE_NAMES)}
PARENTS: tuple[int, ...] = tuple(
    -1 if bone.parent is None else BONE_INDEX[bone.parent] for bone in BONES
)
FOREARM_GROUPS = ("lowerarm01.R", "lowerarm02.R", "upperarm01.R", "upperarm02.R")
"""Asset weights that are shared among the forearm bones by position along the forearm."""

"""What a hand wears, drawn once an image: plain values that the label records."""

from dataclasses import dataclass
from enum import StrEnum

from services.worker.ornaments.mesh import OrnamentMaterial


class Stone(StrEnum):
    """How a ring's stone is cut."""

    FACETED = "faceted"
    CABOCHON = "cabochon"
    PEARL = "pearl"


class BraceletKind(StrEnum):
    """What a bracelet is."""

    BANGLE = "bangle"
    BEADS = "beads"
    BRAIDED = "braided"


class StrapKind(StrEnum):
    """What holds a watch."""

    LEATHER = "leather"
    RUBBER = "rubber"
    LINKS = "links"


@dataclass(frozen=True)
class StoneWorn:
    """A stone on a ring: its cut, radius and stuff."""

    cut: Stone
    radius_m: float
    material: OrnamentMaterial


@dataclass(frozen=True)
class RingWorn:
    """A ring on a finger: `along` is the share of the way from knuckle to middle joint."""

    finger: str
    along: float
    width_m: float
    thickness_m: float
    metal: OrnamentMaterial
    stone: StoneWorn | None


@dataclass(frozen=True)
class BraceletWorn:
    """A bracelet `from_wrist_m` up the forearm; `lean_deg` is the side on which it rests."""

    kind: BraceletKind
    from_wrist_m: float
    size_m: float
    slack_m: float
    lean_deg: float
    material: OrnamentMaterial
    second: OrnamentMaterial


@dataclass(frozen=True)
class WatchWorn:
    """A watch on the back of the wrist, showing a time."""

    from_wrist_m: float
    case_radius_m: float
    case_height_m: float
    hour: float
    markers: int
    strap: StrapKind
    strap_width_m: float
    metal: OrnamentMaterial
    dial: OrnamentMaterial
    marks: OrnamentMaterial
    strap_material: OrnamentMaterial


@dataclass(frozen=True)
class SleeveWorn:
    """A sleeve from `from_wrist_m` up the forearm on; its folds follow from their own seed.

    ease_m: how much further from the arm it is. A cuff of cuff_m is stiff, with a seam seam_m from
    its edge; gathered: the cloth behind it is pleated into it. Buttons stand button_turn of a full
    turn about the arm. inner: a shirt's cuff that shows under a jacket's.
    """

    from_wrist_m: float
    ease_m: float
    thickness_m: float
    cuff_m: float
    seam_m: float
    gathered: bool
    fold_m: float
    fold_seed: int
    material: OrnamentMaterial
    inner: OrnamentMaterial | None
    buttons: int
    buttons_at_m: float
    button_radius_m: float
    button_turn: float
    button: OrnamentMaterial


@dataclass(frozen=True)
class Worn:
    """Everything a hand wears beside nail polish, which is part of its skin; None where nothing."""

    ring: RingWorn | None = None
    bracelet: BraceletWorn | None = None
    watch: WatchWorn | None = None
    sleeve: SleeveWorn | None = None


BARE = Worn()

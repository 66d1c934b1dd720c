"""The columns of a label table as Croissant fields."""

from dataclasses import dataclass

from hi5_common.domain.spec import LabelKind
from hi5_common.domain.vocabulary import KEYPOINTS, Attribute

_POINTS = len(KEYPOINTS)
TEXT, WHOLE, REAL, IMAGE = "sc:Text", "cr:Int64", "cr:Float64", "sc:ImageObject"


@dataclass(frozen=True)
class Column:
    """A field of the labels. shape: of an array, None for a single value; kind: always, if None.

    path: what to take out of a column that holds a structure.
    """

    name: str
    type: str
    meaning: str
    shape: tuple[int, ...] | None = None
    kind: LabelKind | None = None
    path: str | None = None

    @property
    def column(self) -> str:
        """The column that the field is read from."""
        return self.name if self.path is None else self.name.rsplit("_", 1)[0]


def _mask(name: str, of: str) -> tuple[Column, ...]:
    return (
        Column(
            f"{name}_counts",
            TEXT,
            f"COCO compressed run lengths of the mask of {of}; its size is height_px, width_px.",
            kind=LabelKind.MASK,
            path="counts",
        ),
    )


COLUMNS: tuple[Column, ...] = (
    Column("index", WHOLE, "Number of the image in the dataset."),
    Column("split", TEXT, "The split that the image belongs to; null if there are none."),
    Column(
        "twin_group",
        WHOLE,
        "Number of the scene that the image shows, as its twins do; null if there are none.",
    ),
    Column("file_name", TEXT, "File name of the picture."),
    Column("width_px", WHOLE, "Width of the picture."),
    Column("height_px", WHOLE, "Height of the picture."),
    *(
        Column(name.value, TEXT, f"What {name.value} the image was planned to have.")
        for name in Attribute
    ),
    Column("affect", TEXT, "What the pose is said to imply; not what a person feels."),
    Column("intrinsics_px", REAL, "Pinhole camera, 3 x 3, row by row.", (9,)),
    Column("world_to_camera_m", REAL, "World to camera, 4 x 4, row by row, metres.", (16,)),
    Column(
        "keypoints_image_px",
        REAL,
        "x and y of the 21 points in continuous pixels; null behind the camera. Order: "
        f"{', '.join(KEYPOINTS)}.",
        (_POINTS, 2),
        LabelKind.KEYPOINTS,
    ),
    Column(
        "keypoints_camera_m",
        REAL,
        "The points in the camera's frame (OpenCV), metres.",
        (_POINTS, 3),
        LabelKind.KEYPOINTS,
    ),
    Column(
        "keypoints_world_m",
        REAL,
        "The points in the world, metres, z up.",
        (_POINTS, 3),
        LabelKind.KEYPOINTS,
    ),
    Column(
        "keypoints_visibility",
        WHOLE,
        "0 behind the camera, 1 out of frame, 2 hidden, 3 visible.",
        (_POINTS,),
        LabelKind.KEYPOINTS,
    ),
    Column(
        "keypoints_occluder",
        TEXT,
        "What hides each point that is hidden.",
        (_POINTS,),
        LabelKind.KEYPOINTS,
    ),
    Column(
        "keypoints_depth_margin_mm",
        REAL,
        "How far in front of each point the first surface on its line of sight lies.",
        (_POINTS,),
        LabelKind.KEYPOINTS,
    ),
    Column(
        "box_px",
        REAL,
        "Box of all that is rendered: left, top, width, height.",
        (4,),
        LabelKind.BOX,
    ),
    Column("hand_box_px", REAL, "Box of the hand alone.", (4,), LabelKind.BOX),
    *_mask("mask", "all that is rendered"),
    *_mask("hand_mask", "the hand's skin that shows"),
    Column("in_frame_share", REAL, "Share of the hand's surface inside the frame."),
    Column("scene", TEXT, "The resolved scene with versions and hashes, JSON."),
)
"""In the order of the table."""

"""What each pose implies, in the words of the Hi5 paper's table of poses and motions."""

from collections.abc import Mapping
from types import MappingProxyType

from hi5_common.domain.vocabulary import Pose

POSE_AFFECT_IN_PAPER: Mapping[Pose, str] = MappingProxyType(
    {
        Pose.NEUTRAL_RELAXED: "Baseline state; calm or disengaged",
        Pose.NEUTRAL_RIGID: "Slight tension; discomfort or guardedness",
        Pose.GOOD_LUCK: "Hopeful anticipation, anxious optimism",
        Pose.FAKE_GUN: "Playful or mildly confrontational, context-dependent",
        Pose.STAR_TREK: "Cultural symbol; peace, formality, or sci-fi fandom",
        Pose.EXTENDED_THUMB: "Request, openness, or informal friendliness",
        Pose.THUMB_UP_RELAXED: "Casual approval, positive but informal",
        Pose.THUMB_UP_NORMAL: "Agreement or encouragement",
        Pose.THUMB_UP_RIGID: "Strong approval or assertive positivity",
        Pose.THUMB_TUCK_NORMAL: "Passive stance; possibly insecure",
        Pose.THUMB_TUCK_RIGID: "Guarded or defensive self-comfort",
        Pose.A_OKAY: "Approval, everything is fine",
        Pose.A_OKAY_UPRIGHT: "Assertive or emphatic approval",
        Pose.SURFER: "Relaxed, friendly, laid-back",
        Pose.ROCKER: "Enthusiasm, rebelliousness (rock culture)",
        Pose.ROCKER_FRONT: "Expressive engagement or intensity",
        Pose.ROCKER_BACK: "Dismissive or distanced gesture",
        Pose.FIST: "Determination, strength, or readiness",
        Pose.FIST_RIGID: "Aggression, anger, or tension",
        Pose.ALLIGATOR_CLOSED: "Playful or aggressive storytelling",
        Pose.ONE: "pointer finger",
        Pose.TWO: "Peace sign, V",
        Pose.THREE: "Number three",
        Pose.FOUR: "Number four",
        Pose.FIVE: "Open palm, displaying openness",
        Pose.INDEX_TIP: "Precision or pointing focus",
        Pose.MIDDLE_TIP: "Emphasis or clarity in focus",
        Pose.RING_TIP: "Delicacy or gentleness",
        Pose.PINKY_TIP: "Subtlety or playfulness",
        Pose.PALM_UP: "Openness, offering, or request",
        Pose.FINGER_SPREAD_RELAXED: "Casual openness or readiness",
        Pose.FINGER_SPREAD_NORMAL: "Attention or mild alertness",
        Pose.FINGER_SPREAD_RIGID: "High tension or strong assertiveness",
        Pose.CAPISCE: "Inquiry, emphasis, or theatrical disbelief",
        Pose.CLAWS: "Aggression, frustration, or drama",
        Pose.PEACOCK: "Display, pride, or flamboyance",
        Pose.CUP: "Nurturing, receiving, or inquiry",
        Pose.SHAKESPEARES_YORICK: "Reflective, dramatic, sorrowful",
        Pose.DINOSAUR: "Playful, exaggerated, humorous",
        Pose.MIDDLE_FINGER: "Aggression, rejection, or disrespect",
        Pose.RELAXED_WAVE: "Friendly or casual greeting/farewell",
        Pose.FIST_WAVE: "Unity or playful strength",
        Pose.PROM_WAVE: "Formality, politeness, or sarcasm",
    }
)
"""All 43 rows of the table, letter for letter."""

POSE_AFFECT_NOT_IN_PAPER: Mapping[Pose, str] = MappingProxyType(
    {Pose.ALLIGATOR_OPEN: "Playful or mock-threatening storytelling, about to snap"}
)
"""The paper counts 44 poses and lists 43: this one is hi5's own reading, after its closed twin."""

POSE_AFFECT: Mapping[Pose, str] = MappingProxyType(
    {pose: {**POSE_AFFECT_IN_PAPER, **POSE_AFFECT_NOT_IN_PAPER}[pose] for pose in Pose}
)
"""The implied affect of every pose, in canonical order."""

"""The resolved scene as plain JSON: enough to see why a picture looks as it does."""

import json
from dataclasses import asdict, dataclass
from typing import Any

from hi5_common.domain.spec import RenderRequest
from hi5_common.version import hi5_version
from services.worker.render.calibration import Choice
from services.worker.render.port import Renderer
from services.worker.scene.environments import entry_of, light_of, panorama_sha256
from services.worker.scene.types import HandScene


@dataclass(frozen=True)
class Making:
    """What made a picture, beside its scene."""

    renderer: str
    renderer_versions: dict[str, str]
    request: RenderRequest
    choice: Choice
    hand_sha256: str

    @classmethod
    def of(
        cls, renderer: Renderer, request: RenderRequest, choice: Choice, hand_sha256: str
    ) -> "Making":
        """Read the renderer's name and versions."""
        name = renderer.name_of(choice.settings)
        return cls(name, renderer.versions, request, choice, hand_sha256)


def provenance(scene: HandScene, making: Making) -> dict[str, Any]:
    """Return everything that went into the picture of a scene, as JSON values."""
    document = {
        "shape": asdict(scene.shape),
        "pose_blend": asdict(scene.blend),
        "motion_phase": scene.phase,
        "joint_angles_deg": asdict(scene.angles),
        "stance": asdict(scene.stance),
        "view": asdict(scene.view),
        "view_attempt": scene.view_attempt,
        "draw": scene.draw,
        "hand_to_world_m": scene.hand_to_world.tolist(),
        "light": asdict(scene.light),
        "place": _place(scene.light.environment),
        "skin": asdict(scene.skin),
        "worn": asdict(scene.worn),
        "camera_look": asdict(scene.look),
        "render_seed": scene.render_seed,
        "renderer": making.renderer,
        "renderer_versions": making.renderer_versions,
        "render": making.request.model_dump(mode="json", exclude_none=True),
        "settings": asdict(making.choice.settings),
        "prediction": _prediction(making.choice),
        "hi5_version": hi5_version(),
        "assets_sha256": {
            "hand": making.hand_sha256,
            "panorama": panorama_sha256(scene.light.environment),
        },
    }
    # Through JSON once, so that a label read back equals the label that was written.
    plain: dict[str, Any] = json.loads(json.dumps(document))
    return plain


def _prediction(choice: Choice) -> dict[str, Any] | None:
    """Return what the samples were chosen by; None for a quality, which has its own."""
    if choice.calibration is None:
        return None
    return {
        "calibration": choice.calibration,
        "error": choice.predicted_error,
        "seconds": choice.predicted_s,
    }


def _place(environment: str) -> dict[str, Any]:
    entry = entry_of(environment)
    return asdict(entry) | {"light_level": light_of(environment).value}

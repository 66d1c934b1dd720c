"""From what a hand wears to meshes on its posed skin."""

from services.worker.ornaments.bracelet import bracelet_meshes
from services.worker.ornaments.limbs import PosedLimbs
from services.worker.ornaments.mesh import OrnamentMesh
from services.worker.ornaments.ring import ring_meshes
from services.worker.ornaments.sleeve import sleeve_meshes
from services.worker.ornaments.watch import watch_meshes
from services.worker.ornaments.worn import Worn


def fitted(worn: Worn, limbs: PosedLimbs) -> tuple[OrnamentMesh, ...]:
    """Return the meshes of everything worn (nail polish is the skin's), in the elbow frame.

    A pure function, a few milliseconds; nothing worn gives no mesh. OrnamentUnfit where a limb has
    no outline to sit on.
    """
    meshes: list[OrnamentMesh] = []
    if worn.ring is not None:
        meshes += ring_meshes(worn.ring, limbs)
    if worn.bracelet is not None:
        meshes += bracelet_meshes(worn.bracelet, limbs)
    if worn.watch is not None:
        meshes += watch_meshes(worn.watch, limbs)
    if worn.sleeve is not None:
        meshes += sleeve_meshes(worn.sleeve, limbs)
    return tuple(meshes)

"""The processors that Cycles can trace paths on: listed, and one of them taken by its id.

    python -m services.worker.render.blender.devices

prints them as JSON, in a process that a broken driver may crash. No GPU was ever at hand when this
was written: see the README.
"""

import json
import os
import sys
from dataclasses import asdict, dataclass

import bpy

from services.worker.render.errors import DeviceMissing

CPU = "cpu"
KINDS = ("OPTIX", "CUDA", "HIP", "ONEAPI", "METAL")
"""As Cycles calls them, the one to be preferred first."""


@dataclass(frozen=True)
class Device:
    """A device as Cycles knows it. setting: what HI5_DEVICE names it by."""

    kind: str
    id: str
    name: str

    @property
    def setting(self) -> str:
        """Return what HI5_DEVICE is set to for this very device."""
        return f"{self.kind.lower()}:{self.id}"


def devices() -> list[Device]:
    """Return the devices of every kind that this build of Blender knows; the CPU is always there.

    A kind whose driver is missing has none.
    """
    found = [
        Device(kind, device.id, device.name)
        for kind in KINDS
        if kind in _known_kinds()
        for device in _preferences().get_devices_for_type(kind)
        if device.type == kind
    ]
    return sorted(found, key=lambda device: (KINDS.index(device.kind), device.id))


def take(scene: bpy.types.Scene, wanted: str) -> str:
    """Trace a scene's paths on the device of a setting (see Settings.device); return its name.

    Raises DeviceMissing if it is not there or Cycles does not take it: Cycles itself would go on
    with the CPU and say nothing.
    """
    if wanted == CPU:
        scene.cycles.device = "CPU"
        return CPU
    kind, _, identity = wanted.partition(":")
    kind = kind.upper()
    here = devices()
    fitting = [d for d in here if d.kind == kind and identity in {"", d.id}]
    if not fitting:
        known = ", ".join([CPU, *(device.setting for device in here)])
        raise DeviceMissing(f"HI5_DEVICE: {wanted!r} is not here. Here are: {known}.")
    chosen = fitting[0]
    preferences = _preferences()
    preferences.compute_device_type = kind
    for device in preferences.devices:
        device.use = device.type == kind and device.id == chosen.id
    scene.cycles.device = "GPU"
    used = [(device.type, device.id) for device in preferences.devices if device.use]
    if used != [(kind, chosen.id)] or not preferences.has_active_device():
        raise DeviceMissing(f"HI5_DEVICE: Cycles does not take {chosen.setting} ({chosen.name}).")
    return f"{kind} {chosen.name}"


def _known_kinds() -> set[str]:
    return {kind for kind, *_ in _preferences().get_device_types(bpy.context)}


def _preferences() -> bpy.types.AddonPreferences:
    return bpy.context.preferences.addons["cycles"].preferences


if __name__ == "__main__":
    rows = [{**asdict(device), "setting": device.setting} for device in devices()]
    sys.stdout.write(json.dumps([{"setting": CPU, "name": "CPU"}, *rows]) + "\n")
    sys.stdout.flush()
    os._exit(0)  # past Blender's own exit, which may crash

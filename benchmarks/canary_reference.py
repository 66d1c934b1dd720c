"""Write the references of the canary as this machine renders them: look at them before you commit.

python -m benchmarks.canary_reference
"""

import json
from pathlib import Path

from hi5_common.settings import RendererName, Settings
from services.worker.fleet import canary


def main() -> None:
    folder = Path(canary.__file__).parent / canary.REFERENCES
    folder.mkdir(exist_ok=True)
    for renderer in RendererName:
        settings = Settings(renderer=renderer)
        image, label = canary.known_image(settings, lambda: False)
        (folder / f"{renderer.value}.png").write_bytes(image)
        document = json.dumps(canary.compared_part(label), indent=1)
        (folder / "label.json").write_text(document + "\n", encoding="utf-8")
        print(f"{renderer.value}: {len(image)} bytes")


if __name__ == "__main__":
    main()

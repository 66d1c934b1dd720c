"""A local server that speaks as much of Poly Haven's documented API as hi5 uses."""

import hashlib
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import ClassVar

import numpy as np

from services.worker.places.exr import write_panorama

ASSET = "test_meadow"
AUTHOR = "A Test"


@dataclass
class Behaviour:
    """What the server does wrong, and what it saw."""

    exr: bytes
    drops: int = 0
    ignores_ranges: bool = False
    md5: str | None = None
    agents: list[str] = field(default_factory=list)
    ranges: list[str | None] = field(default_factory=list)
    base: str = ""


def picture(folder: Path) -> bytes:
    """Return an EXR file of 128 x 64 texels, large enough to break off in."""
    rng = np.random.Generator(np.random.Philox(7))
    path = folder / "served.exr"
    write_panorama(path, rng.uniform(0.2, 0.8, (64, 128, 3)).astype(np.float32))
    return path.read_bytes()


class Handler(BaseHTTPRequestHandler):
    """Answers as its `behaviour` says."""

    behaviour: ClassVar[Behaviour]

    def log_message(self, *_: object) -> None:
        """Keep quiet."""

    def do_GET(self) -> None:
        self.behaviour.agents.append(self.headers.get("User-Agent", ""))
        if self.path == "/file.exr":
            self._file()
        elif self.path == f"/info/{ASSET}":
            categories = ["outdoor", "nature"]
            self._json(
                {
                    "type": 0,
                    "name": "Test Meadow",
                    "authors": {AUTHOR: "All"},
                    "categories": categories,
                }
            )
        elif self.path == f"/files/{ASSET}":
            md5 = (
                self.behaviour.md5
                or hashlib.md5(self.behaviour.exr, usedforsecurity=False).hexdigest()
            )
            exr = {
                "url": f"{self.behaviour.base}/file.exr",
                "md5": md5,
                "size": len(self.behaviour.exr),
            }
            self._json({"hdri": {"1k": {"exr": exr}, "2k": {"exr": exr}}})
        elif self.path == "/assets?type=hdris":
            self._json({"rare": {"download_count": 1}, ASSET: {"download_count": 9}})
        else:
            self.send_error(404)

    def _json(self, document: object) -> None:
        body = json.dumps(document).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def _file(self) -> None:
        asked = self.headers.get("Range")
        self.behaviour.ranges.append(asked)
        start = int(asked[6:-1]) if asked and not self.behaviour.ignores_ranges else 0
        body = self.behaviour.exr[start:]
        self.send_response(206 if start else 200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.behaviour.drops > 0:
            self.behaviour.drops -= 1
            self.wfile.write(body[: len(body) // 2])
            self.wfile.flush()
            self.connection.close()
            return
        self.wfile.write(body)


@contextmanager
def serving(behaviour: Behaviour) -> Iterator[str]:
    """Run the server; yield the address of its API."""
    server = ThreadingHTTPServer(
        ("127.0.0.1", 0), type("Told", (Handler,), {"behaviour": behaviour})
    )
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    behaviour.base = f"http://127.0.0.1:{server.server_port}"
    try:
        yield behaviour.base
    finally:
        server.shutdown()
        server.server_close()
        thread.join()

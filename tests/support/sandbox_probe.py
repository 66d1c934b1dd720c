"""Stands in for the decoder and tells, in one line, what it could do if it were taken over."""

import json
import os
import resource
import socket
import sys

from services.worker.places import decoding


def main() -> int:
    _, out, memory_bytes, out_bytes = sys.argv[1:]
    try:
        decoding.confine(int(memory_bytes), int(out_bytes))
        interfaces = [name for _, name in socket.if_nameindex()]
        found = {
            "names": sorted(os.environ),
            "files": resource.getrlimit(resource.RLIMIT_NOFILE),
            "cpu": resource.getrlimit(resource.RLIMIT_CPU),
            "memory": _takes(int(memory_bytes)),
            "writes": _writes(out, int(out_bytes) + 1),
            "nets": interfaces,
            "bytecode": not sys.dont_write_bytecode,
        }
    except OSError as error:
        found = {"error": str(error)}
    sys.stderr.write(json.dumps(found, separators=(",", ":")))
    return decoding.REFUSED


def _takes(size: int) -> bool:
    try:
        bytearray(size)
    except MemoryError:
        return False
    return True


def _writes(path: str, size: int) -> bool:
    try:
        with open(path, "wb", buffering=0) as file:  # noqa: PTH123  what a decoder does
            return file.write(bytes(size)) == size
    except OSError:
        return False


if __name__ == "__main__":
    sys.exit(main())

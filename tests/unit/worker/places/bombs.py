"""Files that hurt who decodes them: small, and made here, each under the name that it pretends."""

import gzip
import io
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence

WIDTH, HEIGHT = 64, 32
HALF, FLOAT = 1, 2
ZIPS, ZIP, PIZ, B44, DWAA = 2, 3, 4, 6, 8
TILED, DEEP, PARTS = 0x200, 0x800, 0x1000
ZIP_LINES = 16

Window = tuple[int, int, int, int]
WHOLE: Window = (0, 0, WIDTH - 1, HEIGHT - 1)


def channels(count: int, kind: int = HALF, step: int = 1) -> bytes:
    """Return a list of channels; the first three are B, G, R."""
    names = ["B", "G", "R"][:count] + [f"c{number:05d}" for number in range(3, count)]
    entry = struct.pack("<iIii", kind, 0, step, step)
    return b"".join(name.encode() + b"\0" + entry for name in names) + b"\0"


def attribute(name: bytes, kind: bytes, value: bytes, length: int | None = None) -> bytes:
    """Return an attribute; length is what it says of its value, if that is a lie."""
    size = len(value) if length is None else length
    return name + b"\0" + kind + b"\0" + struct.pack("<i", size) + value


def header(
    window: Window = WHOLE,
    listed: bytes = channels(3),
    compression: int = ZIP,
    flags: int = 0,
    more: bytes = b"",
    end: bytes = b"\0",
) -> bytes:
    """Return an OpenEXR header, whole unless told otherwise."""
    box = struct.pack("<4i", *window)
    parts = [
        b"\x76\x2f\x31\x01" + struct.pack("<I", 2 | flags),
        attribute(b"channels", b"chlist", listed),
        attribute(b"compression", b"compression", bytes([compression])),
        attribute(b"dataWindow", b"box2i", box),
        attribute(b"displayWindow", b"box2i", box),
        attribute(b"lineOrder", b"lineOrder", b"\0"),
        attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1.0)),
        attribute(b"screenWindowCenter", b"v2f", bytes(8)),
        attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1.0)),
        more,
        end,
    ]
    return b"".join(parts)


def exr(chunks: Sequence[bytes], compression: int = ZIP, lines: int = ZIP_LINES) -> bytes:
    """Return a file with a good header and these chunks, whatever is in them."""
    head = header(compression=compression)
    place = len(head) + 8 * len(chunks)
    offsets, body = b"", b""
    for number, chunk in enumerate(chunks):
        offsets += struct.pack("<Q", place + len(body))
        body += struct.pack("<ii", number * lines, len(chunk)) + chunk
    return head + offsets + body


def hdr(resolution: str, body: bytes = b"", form: str = "32-bit_rle_rgbe") -> bytes:
    """Return a Radiance picture with this line of its size."""
    return f"#?RADIANCE\nFORMAT={form}\n\n{resolution}\n".encode() + body


def png(width: int, height: int, *chunks: tuple[bytes, bytes]) -> bytes:
    """Return a PNG with its checksums right."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    first = struct.pack(">IIBBBBB", width, height, 16, 6, 0, 0, 0)
    rest = b"".join(chunk(kind, data) for kind, data in chunks)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", first) + rest + chunk(b"IEND", b"")


def jpeg(width: int, height: int, scans: int) -> bytes:
    """Return a progressive JPEG of many empty scans."""
    frame = struct.pack(">BHHBBBB", 8, height, width, 1, 1, 0x11, 0)
    scan = b"\xff\xda" + struct.pack(">H", 8) + bytes([1, 1, 0, 0, 0, 0])
    return b"\xff\xd8\xff\xc2" + struct.pack(">H", len(frame) + 2) + frame + scan * scans


def packed(size: int) -> bytes:
    return zlib.compress(bytes(size), 9)


def zipped(size: int) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.hdr", bytes(size))
    return buffer.getvalue()


def _line(width: int = WIDTH) -> bytes:
    return b"\x02\x02" + struct.pack(">H", width)


HUGE = 10**9
FULL = "-Y 32 +X 64"
BOMBS: Mapping[str, Callable[[], bytes]] = {
    # Headers that lie of sizes.
    "window of 1e9 x 1e9.exr": lambda: header((0, 0, HUGE - 1, HUGE - 1)),
    "window of 2e9 from the left.exr": lambda: header((-(2**31), 0, 2**31 - 1, 2**30 - 1)),
    "window backwards.exr": lambda: header((63, 31, 0, 0)),
    "window of one line of 2e9.exr": lambda: header((0, 0, 2**31 - 1, 0)),
    "window of 16384 x 8192 floats.exr": lambda: header((0, 0, 16383, 8191), channels(4, FLOAT)),
    "window of 8192 x 4096 in 400 bytes.exr": lambda: header((0, 0, 8191, 4095)),
    "ten thousand channels.exr": lambda: header(listed=channels(10_000)),
    "no channels.exr": lambda: header(listed=b"\0"),
    "channels cut off.exr": lambda: header(listed=channels(3)[:-9]),
    "channels of no kind.exr": lambda: header(listed=channels(3, kind=7)),
    "channels sampled by zero.exr": lambda: header(listed=channels(3, step=0)),
    "channels sampled by a million.exr": lambda: header(listed=channels(3, step=10**6)),
    "deep.exr": lambda: header(flags=DEEP),
    "many parts.exr": lambda: header(flags=PARTS),
    "of a version to come.exr": lambda: header(flags=0x4000),
    "compressed by nothing known.exr": lambda: header(compression=77),
    "ripmaps.exr": lambda: header(
        flags=TILED, more=attribute(b"tiles", b"tiledesc", struct.pack("<IIB", 32, 32, 2))
    ),
    "tiles of nothing.exr": lambda: header(
        flags=TILED, more=attribute(b"tiles", b"tiledesc", struct.pack("<IIB", 0, 0, 0))
    ),
    "tiles of four billion.exr": lambda: header(
        flags=TILED, more=attribute(b"tiles", b"tiledesc", struct.pack("<IIB", 2**32 - 1, 2**31, 0))
    ),
    "an attribute of two gigabytes.exr": lambda: header(
        more=attribute(b"note", b"string", b"x", 2**31 - 1)
    ),
    "an attribute of less than nothing.exr": lambda: header(
        more=attribute(b"note", b"string", b"x", -1)
    ),
    "an attribute that fills the header.exr": lambda: header(
        more=attribute(b"note", b"string", bytes(4 << 20))
    ),
    "a hundred thousand attributes.exr": lambda: header(
        more=b"".join(attribute(b"n%06d" % n, b"int", bytes(4)) for n in range(100_000))
    ),
    "the window twice.exr": lambda: header(
        more=attribute(b"dataWindow", b"box2i", struct.pack("<4i", 0, 0, HUGE, HUGE))
    ),
    "a name without end.exr": lambda: header(more=b"n" * 5000),
    "a header without end.exr": lambda: header(end=b""),
    "eight bytes.exr": lambda: header()[:8],
    # Headers that are right, above bodies that are not.
    "no chunks.exr": lambda: header() + bytes(16),
    "chunks at the end of the world.exr": lambda: header() + struct.pack("<QQ", 2**63, 2**62) * 9,
    "chunks that are each other.exr": lambda: (
        header() + struct.pack("<QQ", len(header()), len(header())) + bytes(64)
    ),
    "a chunk that unpacks to a gigabyte.exr": lambda: exr([packed(1 << 28), packed(64)]),
    "a chunk of noise, ZIP.exr": lambda: exr([b"\x5a" * 999] * 2),
    "a chunk of noise, PIZ.exr": lambda: exr([b"\x5a" * 999], PIZ, 32),
    "a chunk of noise, B44.exr": lambda: exr([b"\x5a" * 999], B44, 32),
    "a chunk of noise, DWAA.exr": lambda: exr([b"\x5a" * 999], DWAA, 32),
    # Radiance.
    "a billion lines.hdr": lambda: hdr("-Y 500000000 +X 1000000000"),
    "more digits than numbers.hdr": lambda: hdr(f"-Y {'9' * 4000} +X {'9' * 4000}"),
    "less than nothing.hdr": lambda: hdr("-Y -32 +X -64"),
    "upside down.hdr": lambda: hdr("+Y 32 +X 64", bytes(9000)),
    "on its side.hdr": lambda: hdr("-X 64 +Y 32", bytes(9000)),
    "8192 x 4096 in 60 bytes.hdr": lambda: hdr("-Y 4096 +X 8192"),
    "xyz.hdr": lambda: hdr(FULL, bytes(9000), "32-bit_rle_xyze"),
    "a header of a megabyte.hdr": lambda: b"#?RADIANCE\n" + b"NOTE=x\n" * 150_000 + b"\n",
    "runs past their line.hdr": lambda: hdr(FULL, (_line() + b"\xff\x01" * 40) * 32),
    "runs of no length.hdr": lambda: hdr(FULL, (_line() + b"\x00" * 200) * 32),
    "lines of another width.hdr": lambda: hdr(FULL, (_line(32767) + bytes(300)) * 32),
    "half of it.hdr": lambda: hdr(FULL, (_line() + b"\xc0\x80" * 4) * 16),
    # Other formats by a name that is taken in.
    "png of 1e5 x 1e5.hdr": lambda: png(100_000, 100_000, (b"IDAT", packed(1 << 20))),
    "png that unpacks to 64 MB.exr": lambda: png(64, 32, (b"IDAT", packed(64 << 20))),
    "png with a profile that unpacks.hdr": lambda: png(
        64, 32, (b"iCCP", b"p\0\0" + packed(64 << 20))
    ),
    "png with a text that unpacks.hdr": lambda: png(64, 32, (b"zTXt", b"t\0\0" + packed(64 << 20))),
    "png that moves.hdr": lambda: png(64, 32, (b"acTL", struct.pack(">II", 2**31 - 1, 0))),
    "jpeg of 65535 x 65535.hdr": lambda: jpeg(65_535, 65_535, 1),
    "jpeg of ten thousand scans.hdr": lambda: jpeg(16_384, 8_192, 10_000),
    "gzip of 64 MB.hdr": lambda: gzip.compress(bytes(64 << 20), 9),
    "zip of 64 MB.exr": lambda: zipped(64 << 20),
    "a blend.hdr": lambda: b"BLENDER-v405" + bytes(4096),
    "a packed blend.exr": lambda: b"\x28\xb5\x2f\xfd" + bytes(4096),
    "radiance by the name of openexr.exr": lambda: hdr(FULL, bytes(9000)),
    "openexr by the name of radiance.hdr": lambda: exr([packed(64)] * 2),
    "both at once.hdr": lambda: b"#?RADIANCE" + header(),
    "a picture with a zip behind.exr": lambda: header() + zipped(1 << 20),
    "markup.hdr": lambda: b"<svg xmlns='x'><script>alert(1)</script></svg>",
    "nothing.hdr": lambda: b"",
    "zeros.exr": lambda: bytes(1 << 20),
}

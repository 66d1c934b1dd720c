"""A hundred bodies that no client should send, as the bytes that go over the wire."""

import gzip
import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass

JSON, YAML = "application/json", "application/yaml"
GOOD = json.dumps({"name": "x", "count": 5, "labels": ["box"], "image": {"width": 64}}).encode()
DIGITS = "9" * 5000


@dataclass(frozen=True)
class Wire:
    """Bytes to send after the request line and Host. cut: nobody can answer what never ends."""

    sent: bytes
    cut: bool = False


def post(body: bytes | str, kind: str = JSON, **more: str) -> Wire:
    """Return a body with its true length; more: further headers, with _ for -."""
    data = body if isinstance(body, bytes) else body.encode()
    lines = [f"Content-Type: {kind}", f"Content-Length: {len(data)}"]
    lines += [f"{name.replace('_', '-')}: {value}" for name, value in more.items()]
    return Wire("\r\n".join(lines).encode() + b"\r\n\r\n" + data)


def bare(*lines: str, body: bytes = b"", cut: bool = False) -> Wire:
    """Return headers and a body as they are."""
    return Wire("\r\n".join(lines).encode("latin-1") + b"\r\n\r\n" + body, cut)


def chunk(data: bytes) -> bytes:
    return f"{len(data):x}\r\n".encode() + data + b"\r\n"


def _bomb(levels: int, width: int) -> str:
    lines = ["a0: &a0 [" + ", ".join("x" * width) + "]"]
    lines += [
        f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * width)}]"
        for level in range(1, levels)
    ]
    return "\n".join(lines)


def _merges(levels: int) -> str:
    lines = ["m0: &m0 {k0: 1}"]
    lines += [
        f"m{n}: &m{n} {{<<: [{', '.join([f'*m{n - 1}'] * 9)}], k{n}: 1}}" for n in range(1, levels)
    ]
    return "\n".join(lines)


_JSON_TEXTS: Mapping[str, bytes | str] = {
    **{f"cut after {at} bytes": GOOD[:at] for at in range(1, len(GOOD), 6)},
    "nothing": "",
    "blanks": " \n\t ",
    "null": "null",
    "true": "true",
    "a number": "5",
    "a text": '"count"',
    "a list": "[]",
    "a list of specs": '[{"count": 1}]',
    "two documents": '{"count": 1}{"count": 2}',
    "lines of documents": '{"count": 1}\n{"count": 2}\n',
    "a comma too many": '{"count": 1,}',
    "a comment": '{"count": 1} // one',
    "single quotes": "{'count': 1}",
    "names without quotes": "{count: 1}",
    "deep lists": '{"count": ' + "[" * 100_000,
    "deep lists that end": '{"count": ' + "[" * 100_000 + "]" * 100_000 + "}",
    "deep objects": '{"extends":' * 50_000,
    "specs in specs": '{"count":1,"extends":' * 3000 + "null" + "}" * 3000,
    "a number beyond floats": '{"count": 1e999}',
    "a number below floats": '{"count": -1e999}',
    "a number of 5000 digits": f'{{"count": {DIGITS}}}',
    "a fraction of 5000 digits": f'{{"count": 0.{DIGITS}}}',
    "an exponent of 5000 digits": f'{{"count": 1e{DIGITS}}}',
    "NaN": '{"count": NaN}',
    "Infinity": '{"count": Infinity}',
    "minus Infinity": '{"count": -Infinity}',
    "hexadecimal": '{"count": 0x10}',
    "a leading zero": '{"count": 01}',
    "a leading plus": '{"count": +1}',
    "minus zero": '{"count": -0}',
    "a float": '{"count": 1.0}',
    "a name twice": '{"count": 1, "count": 2}',
    "a name twice, once escaped": '{"count": 1, "\\u0063ount": 2}',
    "a name twice, deep": '{"count": 1, "image": {"width": 64, "width": 65}}',
    "half a surrogate pair": '{"count": 1, "name": "\\ud800"}',
    "the other half": '{"count": 1, "name": "\\udc00"}',
    "halves the wrong way round": '{"count": 1, "name": "\\udc00\\ud800"}',
    "half a surrogate pair as a name": '{"count": 1, "\\ud800": 1}',
    "an escaped NUL": '{"count": 1, "name": "a\\u0000b"}',
    "a NUL": b'{"count": 1, "name": "a\x00b"}',
    "a bare control": b'{"count": 1, "name": "a\x1bb"}',
    "a bare newline": '{"count": 1, "name": "a\nb"}',
    "an escape that is none": '{"count": 1, "name": "\\x41"}',
    "an escape cut off": '{"count": 1, "name": "\\u00"}',
    "a string without end": '{"count": 1, "name": "aaaa',
    "a byte order mark": b"\xef\xbb\xbf" + GOOD,
    "UTF-16": GOOD.decode().encode("utf-16"),
    "UTF-16 without a mark": GOOD.decode().encode("utf-16-le"),
    "UTF-32": GOOD.decode().encode("utf-32"),
    "Latin-1": '{"count": 1, "name": "é"}'.encode("latin-1"),
    "overlong UTF-8": b'{"count": 1, "name": "\xc0\xaf"}',
    "surrogates in UTF-8": b'{"count": 1, "name": "\xed\xa0\x80"}',
    "UTF-8 of five bytes": b'{"count": 1, "name": "\xf8\x88\x80\x80\x80"}',
    "UTF-8 cut off": b'{"count": 1, "name": "\xe2\x82',
    "sixty thousand fields": json.dumps({f"f{n}": n for n in range(60_000)}),
    "sixty thousand values": json.dumps({"count": 1, "attributes": {"pose": ["fist"] * 60_000}}),
    "a megabyte of name": json.dumps({"count": 1, "name": "a" * 1_000_000}),
    "a megabyte of blanks": " " * 1_000_000,
    "gzip": gzip.compress(GOOD),
    "gzip of a gigabyte of zeros, its beginning": zlib.compress(bytes(100 << 20), 9),
    "a zip": b"PK\x03\x04" + bytes(200),
    "__proto__": '{"count": 1, "__proto__": {"admin": true}}',
    "fields of ours": '{"count": 1, "id": "x", "status": "complete", "owner": "root"}',
}  # fmt: skip
_YAML_TEXTS: Mapping[str, bytes | str] = {
    "a reference bomb": _bomb(12, 9),
    "a reference bomb as values": _bomb(9, 9) + "\ncount: 5\nattributes: {pose: *a8}",
    "a reference bomb as names": _bomb(7, 9) + "\ncount: 5\nattributes: {? *a6 : 1}",
    "merges of merges": _merges(12) + "\ncount: 1\nattributes: *m11",
    "a reference to itself": "count: &a [*a]",
    "a mapping in itself": "&a {count: *a}",
    "a reference to nothing": "count: *nobody",
    "a tag of Python": "!!python/object/apply:os.system [id]",
    "a tag of a module": "!!python/module:os",
    "a tag of its own": "count: !mine 5",
    "bytes": "count: !!binary aGk=",
    "a set": "count: !!set {a, b}",
    "a day": "count: 2026-01-01",
    "a day that is none": "count: 2026-99-99",
    "infinity": "count: .inf",
    "not a number": "count: .nan",
    "a hexadecimal of 5000 digits": "count: 0x" + "f" * 5000,
    "a number of 5000 digits": f"count: {DIGITS}",
    "a tab": "count:\n\t5",
    "a name twice": "count: 1\ncount: 2",
    "a list as a name": "? [a, b]\n: 1",
    "a mapping as a name": "? {a: b}\n: 1",
    "two documents": "count: 1\n---\ncount: 2\n",
    "a version to come": "%YAML 9.9\n---\ncount: 1",
    "brackets without end": "[" * 100_000,
    "braces without end": "{a: " * 20_000,
    "dashes": "- " * 50_000,
    "a quote without end": 'name: "aaa',
    "a NUL": b"name: \x00",
    "an escape": b"name: \x1b[2J",
    "half a surrogate pair": 'name: "\\ud800"',
    "a text": "count",
    "not UTF-8": b"name: \xff\xfe",
    "twenty thousand fields": "\n".join(f"f{n}: 1" for n in range(20_000)),
}  # fmt: skip
_KINDS = (
    "text/plain", "text/html", "multipart/form-data; boundary=x", "image/png", "*/*", "json",
    "application/x-www-form-urlencoded", "application/json-patch+json", "application/xml", "",
    "application/json\tx", "application/octet-stream", "application/msgpack", "text/json",
)  # fmt: skip
_LENGTH = f"Content-Length: {len(GOOD)}"
_TYPE = f"Content-Type: {JSON}"
_CHUNKED = "Transfer-Encoding: chunked"
_WIRES: Mapping[str, Wire] = {
    "a length of letters": bare(_TYPE, "Content-Length: many", body=GOOD),
    "a length below zero": bare(_TYPE, "Content-Length: -5", body=GOOD),
    "a length of 30 digits": bare(_TYPE, "Content-Length: " + "9" * 30, body=GOOD),
    "two lengths": bare(_TYPE, _LENGTH, "Content-Length: 3", body=GOOD),
    "a length that is too short": bare(_TYPE, "Content-Length: 9", body=GOOD),
    "a length that is too long": bare(_TYPE, "Content-Length: 9000", body=GOOD, cut=True),
    "a length over the limit": bare(_TYPE, "Content-Length: 99999999", body=GOOD),
    "no length": bare(_TYPE, body=GOOD),
    "a length and chunks": bare(_TYPE, "Content-Length: 3", _CHUNKED, body=b"zz\r\n"),
    "chunks of no size": bare(_TYPE, _CHUNKED, body=b"zz\r\n" + GOOD),
    "chunks of less than nothing": bare(_TYPE, _CHUNKED, body=b"-5\r\n" + GOOD),
    "chunks of a size of 40 digits": bare(_TYPE, _CHUNKED, body=b"f" * 40 + b"\r\n" + GOOD),
    "chunks that do not end": bare(_TYPE, _CHUNKED, body=chunk(GOOD), cut=True),
    "chunks without end": bare(_TYPE, _CHUNKED, body=chunk(b" " * 65_536) * 40),
    "chunks of one byte": bare(_TYPE, _CHUNKED, body=chunk(b"{") * 2000 + b"0\r\n\r\n"),
    "chunks with long notes": bare(_TYPE, _CHUNKED, body=b"5;" + b"a" * 200_000 + b"\r\n"),
    "chunks packed again": bare(_TYPE, "Transfer-Encoding: gzip, chunked", body=chunk(GOOD)),
    "packed in an unknown way": bare(_TYPE, "Transfer-Encoding: snappy", body=GOOD),
    "said to be gzip, and is": post(gzip.compress(GOOD), Content_Encoding="gzip"),
    "said to be UTF-16, and is": post(GOOD.decode().encode("utf-16"), f"{JSON}; charset=utf-16"),
    "a header of a megabyte": bare(_TYPE, "X-Long: " + "a" * 1_000_000, _LENGTH, body=GOOD),
    "a hundred thousand headers": bare(_TYPE, *["X-Many: a"] * 100_000, _LENGTH, body=GOOD),
    "a header without a name": bare(_TYPE, ": a", _LENGTH, body=GOOD),
    "a header with a NUL": bare(_TYPE, "X-Nul: a\0b", _LENGTH, body=GOOD),
    "another host too": bare("Host: evil.example", _TYPE, _LENGTH, body=GOOD),
}  # fmt: skip

WIRES: Mapping[str, Wire] = {
    **{f"JSON: {name}": post(text) for name, text in _JSON_TEXTS.items()},
    **{f"YAML: {name}": post(text, YAML) for name, text in _YAML_TEXTS.items()},
    **{f"type: {kind}": post(GOOD, kind) for kind in _KINDS},
    **{f"wire: {name}": wire for name, wire in _WIRES.items()},
}

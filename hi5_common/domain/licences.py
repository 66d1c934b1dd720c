"""What a licence lets one do with a picture that its work is part of, by its SPDX identifier.

A rendered picture adapts what it shows: a licence without adaptations lets nobody publish it. What
is not known here is unknown, and unknown is not leave.
"""

import re
from dataclasses import dataclass

UNKNOWN = "unknown"
FACTS = "LicenseRef-facts"
QUOTATION = "LicenseRef-quotation"


@dataclass(frozen=True)
class Licence:
    """The terms of a licence. None means that they are not known.

    commercial: use for profit; adaptations: publishing what was made of the work; attribution: its
    author must be named; share_alike: what is made of it must have the same licence.
    """

    id: str
    url: str | None
    commercial: bool | None
    adaptations: bool | None
    attribution: bool | None
    share_alike: bool | None

    @property
    def is_known(self) -> bool:
        return self.commercial is not None

    @property
    def forbids_trade(self) -> bool:
        """Whether it is known that pictures with this work in them may not be used commercially."""
        return self.commercial is False or self.adaptations is False


_CREATIVE_COMMONS = re.compile(
    r"CC-BY(?P<nc>-NC)?(?P<last>-SA|-ND)?-(?P<version>\d\.\d)(?P<port>-[A-Z]{2,3})?", re.IGNORECASE
)
_VERSIONS = frozenset({"1.0", "2.0", "2.5", "3.0", "4.0"})
_SPDX = "https://spdx.org/licenses/{}.html"


def _free(name: str, url: str, *, attribution: bool = False, share_alike: bool = False) -> Licence:
    return Licence(name, url, True, True, attribution, share_alike)


_NAMED = {
    licence.id.lower(): licence
    for licence in (
        _free("CC0-1.0", "https://creativecommons.org/publicdomain/zero/1.0/"),
        _free("PDDL-1.0", _SPDX.format("PDDL-1.0")),
        _free("Unlicense", _SPDX.format("Unlicense")),
        _free("0BSD", _SPDX.format("0BSD")),
        _free("MIT", _SPDX.format("MIT"), attribution=True),
        _free("BSD-2-Clause", _SPDX.format("BSD-2-Clause"), attribution=True),
        _free("BSD-3-Clause", _SPDX.format("BSD-3-Clause"), attribution=True),
        _free("Apache-2.0", _SPDX.format("Apache-2.0"), attribution=True),
        _free("ODC-By-1.0", _SPDX.format("ODC-By-1.0"), attribution=True),
        _free("ODbL-1.0", _SPDX.format("ODbL-1.0"), attribution=True, share_alike=True),
        _free(
            "GPL-3.0-or-later",
            _SPDX.format("GPL-3.0-or-later"),
            attribution=True,
            share_alike=True,
        ),
        # Not licences: numbers and words of a few syllables are nobody's, but have a source.
        Licence(FACTS, None, True, True, False, False),
        Licence(QUOTATION, None, True, True, True, False),
    )
}


def licence_of(identifier: str) -> Licence:
    """Return the terms of an SPDX identifier, in any case; of any other text unknown terms."""
    text = identifier.strip()
    named = _NAMED.get(text.lower())
    if named is not None:
        return named
    match = _CREATIVE_COMMONS.fullmatch(text)
    if match is None or match["version"] not in _VERSIONS:
        return Licence(text or UNKNOWN, None, None, None, None, None)
    return _creative_commons(match)


def _creative_commons(match: re.Match[str]) -> Licence:
    last, version = (match["last"] or "").upper(), match["version"]
    port = (match["port"] or "").upper()
    name = f"CC-BY{'-NC' if match['nc'] else ''}{last}-{version}{port}"
    words = f"by{'-nc' if match['nc'] else ''}{last.lower()}"
    place = f"{port[1:].lower()}/" if port else ""
    return Licence(
        id=name,
        url=f"https://creativecommons.org/licenses/{words}/{version}/{place}",
        commercial=not match["nc"],
        adaptations=last != "-ND",
        attribution=True,
        share_alike=last == "-SA",
    )

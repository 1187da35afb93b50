"""Words of the names of columns, in one spelling whatever the language."""

from __future__ import annotations

import re
import unicodedata

from gearmbs.signals.signal.times import SUFFIX

WORDS_AND_NUMBERS = re.compile(r"[^\W\d_]+|\d+")


def folded(text: str) -> str:
    """Return a text in lower case without accents: "Otáčky" as "otacky"."""
    plain = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    return "".join(c for c in plain if not unicodedata.combining(c)).lower().replace("ω", "omega")


def words_of(name: str) -> list[str]:
    """Return the words and the numbers of a name, without the unit of times at its end."""
    return WORDS_AND_NUMBERS.findall(folded(SUFFIX.sub("", name)))

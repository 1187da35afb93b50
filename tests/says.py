"""What tests ask of messages: names, values and a remedy, in any order; not their sentences."""

import re


def says(*words: str) -> str:
    """Return a pattern of messages in which all words stand, in any order and each as a whole.

    Examples
    --------
    >>> pattern = says("torque", "-5", "give")
    >>> bool(re.search(pattern, "give a positive torque, not -5"))
    True
    >>> bool(re.search(pattern, "torque: -5.5; give a positive one"))
    False
    """
    return r"(?s)\A" + "".join(f"(?=.*{_whole(word)})" for word in words)


def _whole(word: str) -> str:
    """Return the pattern of a word that is no part of a longer one, nor of a number with more digits."""
    before = r"(?<![\w.])" if word[0].isdigit() else r"(?<!\w)" if word[0].isalpha() else ""
    after = r"(?!\w|\.\d)" if word[-1].isdigit() else r"(?!\w)" if word[-1].isalpha() else ""
    return before + re.escape(word) + after

"""Texts of the operator.

What is printed to terminals and lists holds no control characters.
"""

from __future__ import annotations

import unicodedata

from station.errors import UsageError

CONTROLS = ("Cc", "Zl", "Zp")  # control characters, and separators of lines and paragraphs
IN_A_NOTE = "\n\t"


def check_text(name: str, text: str) -> str:
    """Return the text of a label, a title or a note without outer blanks.

    name: what it is of; a note may have lines.
    Raises UsageError for control characters.
    """
    allowed = IN_A_NOTE if name == "note" else ""
    text = text.replace("\r\n", "\n") if allowed else text
    found = next((one for one in text if unicodedata.category(one) in CONTROLS and one not in allowed), None)
    if found is not None:
        raise UsageError(f"the {name} holds the control character U+{ord(found):04X}", "write it without")
    return text.strip()

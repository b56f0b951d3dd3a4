"""Words that a page loses with its light."""

from __future__ import annotations

from restore import Finding, RestoredPage
from station.words.words import Words, recognise


def words_lost(page: RestoredPage, words: Words, *, language: str) -> tuple[Finding, ...]:
    """Return the finding of a page that reads worse without its light.

    words: those of the page without its light.
    """
    if not page.report.get("light", {}).get("removed", False):
        return ()
    kept = recognise(page.master, page.dpi, name="", language=language)
    before, after = (expected_right(read) for read in (kept, words))
    # Half a word is the rounding of a count.
    if after > before - 0.5:
        return ()
    reason = f"{before:.0f} words are expected to be read right with it, and {after:.0f} without it"
    return (Finding.of("light_kept", reason=reason),)


def expected_right(words: Words) -> float:
    """Estimate how many words are read right: their number by the mean confidence."""
    return len(words.text.split()) * words.confidence / 100

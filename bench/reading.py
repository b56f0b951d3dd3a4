"""Words read of small print, of columns, of tables, and of four languages: `python -m bench.reading [SEED [PAGES]]`.

Pages are drawn afresh from the seed, seen by a coarse camera, blurred, with noise, and painted finer, as a restored
page is. They are read in the page's own pixels, and at the size of their type as `planish ocr` does; beside them the
print itself, flat and sharp: what Tesseract misses there no picture can mend. Languages are set in one layout; Greek is
read with Tesseract's data of the language and script together, and with those of the script alone. Data that Tesseract
does not have are named with their package and left out.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable

import cv2
import numpy as np
from PIL import Image, ImageDraw

from drivers.simulated.scene.artwork import Text
from drivers.simulated.scene.artwork.printed import BLACK, blank
from drivers.simulated.scene.artwork.text import SENTENCES
from drivers.simulated.scene.artwork.typeset import Column, typeface
from restore.scan import Bytes
from station.errors import UsageError
from station.words.ocr_precision import MatchCount, count_matching_words
from station.words.words import READING_DPI, check_language, find_tesseract, recognise

PAGE_MM = (120.0, 70.0)
PRINT_DPI, PAGE_DPI = 600, 450
SMALL_CAMERA_DPI, CAMERA_DPI = 150, 100  # for small type and tables, and for the rest: some words are lost
BLUR_PX, NOISE = 1.0, 3.0  # of the camera, pixels and codes
SMALL_PT, TEXT_PT = 5.0, 8.0
ROWS, COLUMNS = 11, 5
SEED, PAGES = 2026, 3

TEXTS: dict[str, tuple[str, ...]] = {
    "eng": SENTENCES,
    "deu": (
        "Die Lumpen wurden von Hand sortiert, und nur das weißeste Leinen kam in die feinsten Bögen.",
        "Zwischen zwei Filzen wird das nasse Blatt gepreßt, bis es fest genug ist, um zu hängen.",
        "Ein geübter Schöpfer tauchte die Form zweimal in der Minute ein, vom Morgen bis zur Dämmerung.",
        "Auf dem Boden hingen die Bögen acht Tage lang über Seilen aus Roßhaar.",
        "Feuchtes Wetter ließ eine Kante quellen, und beim Trocknen wurde aus ihr eine Welle.",
        "Ohne Leim läuft die Tinte aus, und jedem zarten Buchstaben wächst ein Bart.",
        "Der Buchbinder falzt den Bogen dreimal und heftet ihn durch den Rücken.",
        "Jeder Knick bricht einige Fasern, doch die Länge des Blattes ändert sich dabei kaum.",
        "Landkarten faltete man zweimal quer und einmal längs, damit sie in die Rocktasche paßten.",
        "Wer die Oberfläche genau genug mißt, kann sie lesen, ohne sie zu berühren.",
    ),
    "ell": (
        "Τα κουρέλια τα ξεχώριζαν με το χέρι, και μόνο το πιο λευκό λινό γινόταν λεπτό φύλλο.",
        "Ανάμεσα σε δύο τσόχες το υγρό φύλλο πιέζεται ώσπου να αντέχει να κρεμαστεί.",
        "Ένας έμπειρος τεχνίτης βουτούσε το καλούπι δύο φορές το λεπτό από το πρωί ως το βράδυ.",
        "Στη σοφίτα τα φύλλα κρέμονταν οκτώ μέρες πάνω σε σχοινιά από τρίχες αλόγου.",
        "Ο υγρός καιρός φούσκωνε τη μία άκρη, και καθώς στέγνωνε έπαιρνε σχήμα κύματος.",
        "Χωρίς κόλλα το μελάνι απλώνει, και το λεπτό γράμμα βγάζει γένια.",
        "Ο βιβλιοδέτης διπλώνει το τυπωμένο φύλλο τρεις φορές και το ράβει στη ράχη.",
        "Κάθε τσάκιση σπάζει μερικές ίνες, όμως το μήκος του φύλλου μένει το ίδιο.",
        "Τους χάρτες τους δίπλωναν δύο φορές εγκάρσια και μία κατά μήκος, για να χωρούν στην τσέπη.",
        "Όποιος μετρά την επιφάνεια αρκετά καλά μπορεί να διαβάσει χωρίς να αγγίξει τίποτα.",
    ),
    "rus": (
        "Тряпьё разбирали вручную, и только самое белое полотно шло на тонкие листы.",
        "Между двумя сукнами мокрый лист прижимают, пока он не станет достаточно крепким.",
        "Опытный мастер погружал форму дважды в минуту с утра и до наступления темноты.",
        "На чердаке листы восемь дней висели на верёвках из конского волоса.",
        "От сырой погоды один край разбухал, а высыхая, превращался в волну.",
        "Без клея чернила расплываются, и у тонкой буквы вырастает борода.",
        "Переплётчик складывает печатный лист трижды и сшивает его через корешок.",
        "Каждый сгиб ломает несколько волокон, однако длина листа остаётся прежней.",
        "Карты складывали дважды поперёк и один раз вдоль, чтобы они помещались в карман.",
        "Кто достаточно точно измерит поверхность, прочтёт её, ни к чему не прикасаясь.",
    ),
}
READ_AS = {"eng": "eng", "deu": "deu", "ell": "ell", "Greek": "ell", "rus": "rus"}
"""Tesseract's data and the language of the text that they read."""
PACKAGES = {data: f"tesseract-ocr-{data}" for data in READ_AS} | {"Greek": "tesseract-ocr-script-grek"}

Drawn = tuple[Bytes, str]
Draw = Callable[[np.random.Generator], Drawn]
Count = Callable[[str, str], MatchCount]


def small(rng: np.random.Generator) -> Drawn:
    """A page of type of SMALL_PT."""
    return _text((SMALL_PT,), 1, rng)


def columns(rng: np.random.Generator) -> Drawn:
    """A page of two columns."""
    return _text((TEXT_PT,), 2, rng)


def table(rng: np.random.Generator) -> Drawn:
    """A ruled table of words and numbers."""
    picture = Image.fromarray(blank(PAGE_MM, PRINT_DPI))
    pen, font = ImageDraw.Draw(picture), typeface("sans", TEXT_PT, PRINT_DPI)
    left, top, right, bottom = (side * PRINT_DPI / 25.4 for side in (8.0, 6.0, PAGE_MM[0] - 8.0, PAGE_MM[1] - 6.0))
    x, y = np.linspace(left, right, COLUMNS + 1), np.linspace(top, bottom, ROWS + 1)
    names = sorted({word.strip(",.") for sentence in SENTENCES for word in sentence.split() if len(word) > 4})
    cells = []
    for row in range(ROWS):
        for column in range(COLUMNS):
            number = f"{rng.integers(10, 9999)}" if column % 2 else f"{rng.uniform(1, 99):.1f}"
            text = str(rng.choice(names)) if column == 0 or row == 0 else number
            pen.text((x[column] + 40, (y[row] + y[row + 1]) / 2), text, fill=BLACK, font=font, anchor="lm")
            cells.append(text)
    for edge in x:
        pen.line([(edge, top), (edge, bottom)], fill=BLACK, width=6)
    for edge in y:
        pen.line([(left, edge), (right, edge)], fill=BLACK, width=6)
    return np.asarray(picture), " ".join(cells)


def prose(language: str) -> Draw:
    """Draws one column of a language."""

    def draw(rng: np.random.Generator) -> Drawn:
        picture = Image.fromarray(blank(PAGE_MM, PRINT_DPI))
        width, height = picture.size
        margin = 10.0 * PRINT_DPI / 25.4
        column = Column(picture, PAGE_MM, margin, width - margin, margin, height - margin, PRINT_DPI)
        text = " ".join(rng.permutation(TEXTS[language]))
        words = [word.text for word in column.set(text, TEXT_PT, "serif")]
        return np.asarray(picture), " ".join(words)

    return draw


def _text(sizes_pt: tuple[float, ...], count: int, rng: np.random.Generator) -> Drawn:
    text = Text(title_pt=12, sizes_pt=sizes_pt, columns=count, margin_mm=6, seed=int(rng.integers(1 << 20)), dpi=600)
    page = text.print_on(PAGE_MM)
    return page.image, " ".join(word.text for word in page.words)


def painted(image: Bytes, camera_dpi: int, rng: np.random.Generator) -> Bytes:
    """The print as a camera sees it, enlarged to PAGE_DPI."""
    sizes = [tuple(round(side / 25.4 * dpi) for side in PAGE_MM) for dpi in (camera_dpi, PAGE_DPI)]
    seen = cv2.GaussianBlur(cv2.resize(image, sizes[0], interpolation=cv2.INTER_AREA), (0, 0), BLUR_PX)
    seen = np.clip(seen + rng.normal(0, NOISE, seen.shape), 0, 255).astype(np.uint8)
    return np.asarray(cv2.resize(seen, sizes[1], interpolation=cv2.INTER_CUBIC))


def matching_cells(printed: str, read: str) -> MatchCount:
    """Words of a table that are read, in any order: Tesseract reads tables by rows or by columns."""
    ours, theirs = (Counter(text.split()) for text in (printed, read.replace("|", " ")))
    return MatchCount((ours & theirs).total(), max(ours.total(), theirs.total()))


def main(seed: int = SEED, pages: int = PAGES) -> None:
    """Print a line for each kind of page: per cent of words read right."""
    print(f"{'page':<24}{'words':>7}{'own pixels':>12}{'size of its type':>18}{'flat print':>12}")
    kinds: list[tuple[str, Draw, str, Count]] = [
        (f"{SMALL_PT:g} pt", small, "eng", count_matching_words),
        ("two columns", columns, "eng", count_matching_words),
        ("table", table, "eng", matching_cells),
        *((f"{TEXT_PT:g} pt, {data}", prose(text), data, count_matching_words) for data, text in READ_AS.items()),
    ]
    for name, draw, language, count in kinds:
        try:
            check_language(find_tesseract(), language)
        except UsageError as missing:
            print(f"{name:<24}left out: {missing} (package {PACKAGES[language]})")
            continue
        own, sized, flat = (MatchCount(0, 0) for _ in range(3))
        for number in range(pages):
            rng = np.random.default_rng([seed, number])
            image, printed = draw(rng)
            page = painted(image, SMALL_CAMERA_DPI if draw in (small, table) else CAMERA_DPI, rng)
            own += count(printed, recognise(page, READING_DPI, name=name, language=language).text)
            sized += count(printed, recognise(page, PAGE_DPI, name=name, language=language).text)
            flat += count(printed, recognise(image, PRINT_DPI, name=name, language=language).text)
        cells = f"{own.precision:>12.1%}{sized.precision:>18.1%}{flat.precision:>12.1%}"
        print(f"{name:<24}{flat.total:>7}{cells}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

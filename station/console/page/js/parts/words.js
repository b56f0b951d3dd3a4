// The words that were read on a page, laid over it to be marked and copied, and the search in the whole volume.

import { get } from "../api.js";
import { errorText } from "../notices.js";
import { button, h, icon, set, setText } from "../dom.js";
import { field } from "../dialog.js";
import { number } from "../format.js";
import { t } from "../strings.js";

const HEIGHT = 0.8; // of a word's box: size of its letters
const TYPING_MS = 250; // without a key: the word is written

/** Words without accents and capitals, as the search compares them. @param {string} text */
export function plain(text) {
  return text.normalize("NFD").replace(/\p{M}/gu, "").toLowerCase();
}

/** Words over a viewer; `element` is the panel with the search. */
export class Words {
  /** @param {import("./viewer.js").PageViewer} viewer @param {(page: number, part: string) => unknown} go */
  constructor(viewer, go) {
    this.viewer = viewer;
    this.go = go;
    /** @type {Word[]} */ this.words = [];
    this.query = "";
    /** @type {Hit} */ this.chosen = null;
    this.layer = h("g", { class: "words" });
    this.input = h("input", { type: "search", maxlength: 200, autocomplete: "off", on: { input: () => this.later() } });
    this.status = h("p", { class: "soft", role: "status" });
    this.hits = h("ul", { class: "hits" });
    this.element = h("section", { class: "tool-panel", "aria-label": t("tool.words") },
      h("div", { class: "search" }, icon("search"), field(t("words.search"), this.input)), this.status, this.hits);
  }

  /** @param {Row} row @param {PageLeaf} leaf */
  async start(row, leaf) {
    this.row = row;
    this.leaf = leaf;
    this.viewer.over.append(this.layer);
    this.viewer.svg.classList.add("readable");
    setText(this.status, t("words.loading"));
    try {
      this.words = (await get(`/api/pages/${row.page}/words?leaf=${leaf.prefix}`)).words;
      setText(this.status, t("words.count", { n: number(this.words.length) }));
    } catch (error) {
      this.words = [];
      setText(this.status, errorText(error));
    }
    this.draw();
    if (this.query) this.search();
  }

  end() {
    this.layer.remove();
    this.viewer.svg.classList.remove("readable");
  }

  draw() {
    const wanted = plain(this.query).split(/\s+/).filter(Boolean);
    const chosen = this.chosen && this.isShown(this.chosen) ? this.chosen.words : [];
    this.layer.replaceChildren(...this.words.flatMap((word, at) => {
      const hit = wanted.some((one) => plain(word.text).includes(one));
      const text = h("text", { x: word.x, y: word.y + word.h * HEIGHT, textLength: Math.max(word.w, 1), lengthAdjust: "spacingAndGlyphs", "font-size": word.h, text: `${word.text} ` });
      return [h("rect", { x: word.x - 2, y: word.y - 2, width: word.w + 4, height: word.h + 4, class: `${hit ? "hit" : "word"}${chosen.includes(at) ? " chosen" : ""}` }), text];
    }));
  }

  later() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { this.query = this.input.value.trim(); this.chosen = null; this.search(); }, TYPING_MS);
  }

  async search() {
    this.draw();
    if (!this.query) return this.hits.replaceChildren();
    let found;
    try {
      found = await get(`/api/search?q=${encodeURIComponent(this.query)}`);
    } catch (error) {
      return setText(this.status, errorText(error));
    }
    setText(this.status, t("words.found", { n: number(found.hits.length), read: number(found.pages_with_words), pages: number(found.pages) }));
    this.hits.replaceChildren(...found.hits.map((/** @type {Hit} */ hit) => h("li", {},
      button(`${t("page.short", { label: hit.label || hit.page })} · ${hit.text}`, { kind: "quiet hit-button", click: () => this.visit(hit) }))));
    return undefined;
  }

  /** Whether a hit is on the page and the leaf that are shown. @param {Hit} hit */
  isShown({ page, part }) {
    return this.row?.page === page && this.leaf.prefix === (part ? `${part}.` : "");
  }

  // What is chosen is drawn with the words: they may be drawn again at any time, as when the page has changed.
  /** @param {Hit} hit */
  async visit(hit) {
    this.chosen = hit;
    if (!this.isShown(hit)) await this.go(hit.page, hit.part);
    const word = this.words[hit.words[0]];
    if (word) this.viewer.reveal(word);
    this.draw();
    set(this.layer, "data-page", hit.page);
  }
}

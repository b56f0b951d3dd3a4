// One page or two of an opened book: whole, split, or one leaf; and where its spine is, drawn on the scanner's picture.

import { getOrNull } from "../api.js";
import { button, h, segmented, setText } from "../dom.js";
import { present, sourceText } from "../corrections.js";
import { number } from "../format.js";
import { Drawing, FAR } from "./drawing.js";
import { CorrectionTool } from "./tool.js";
import { t } from "../strings.js";

/** @type {Record<string, string>} */ const KEYS = { 0: "whole", 1: "left", 2: "split", 3: "right" };
const CHOICES = ["whole", "left", "split", "right", "auto"];
const MAX_POINTS = 16;
const TENTH = 0.1; // mm, to which places are written: rounded up, so that an error is never said to be zero
const INSET = 0.05; // of the picture: ends of a first spine where none was found

export class LayoutTool extends CorrectionTool {
  /** @param {import("../draft.js").Draft} draft @param {import("./viewer.js").PageViewer} viewer */
  constructor(draft, viewer) {
    const choice = segmented(t("tool.spine"), CHOICES.map((name) => [name, t(`layout.${name}`)]), (name) => this.propose({ layout: name }));
    const found = h("p", { class: "soft" });
    const begin = button(t("spine.draw"), { icon: "pencil", key: "d", click: () => this.begin() });
    const drawing = new Drawing(viewer, { isClosed: false, least: 2, most: MAX_POINTS, changed: (points) => this.take(points) });
    super(draft, { name: "spine", fields: ["layout", "spine"], otherwise: "preset", body: [choice.element, found, begin, h("p", { class: "hint", text: t("spine.keys") }), drawing.element] });
    this.viewer = viewer;
    this.drawing = drawing;
    this.choice = choice;
    this.beginning = begin;
    this.foundText = found;
    /** @type {number} */ this.asked = null;
    /** @type {Layout} */ this.layout = null;
    this.isBegun = false;
    Object.assign(this.keys, { d: () => this.begin(), ArrowLeft: (/** @type {KeyboardEvent} */ { shiftKey }) => this.shift(shiftKey ? -FAR : -1), ArrowRight: (/** @type {KeyboardEvent} */ { shiftKey }) => this.shift(shiftKey ? FAR : 1) });
    for (const [key, name] of Object.entries(KEYS)) this.keys[key] = () => this.propose({ layout: name });
  }

  /** @param {Source[]} sources @param {string} path */
  given(sources, path) {
    if (path === "spine") return super.given(sources, path);
    const { preset_layout: preset } = this.draft.base;
    const giving = sources.filter(({ edits }) => edits.layout || edits.spine).at(-1);
    if (giving) return giving.edits.layout ?? "split"; // a spine that was drawn splits the page
    return preset === "single" ? "whole" : preset;
  }

  /** @param {string} path */
  state(path) {
    const { base } = this.draft;
    if (path === "spine") return [super.state(path)[0], sourceText(present(base, path)[1])];
    const [, source] = [present(base, "layout"), present(base, "spine")].find(([value]) => value) ?? ["", ""];
    return [t(`layout.${this.given(base.sources, path)}`), sourceText(source || "preset")];
  }

  /** Whether the scanner's picture is needed: a spine is drawn there. */
  get isOnScan() {
    return Boolean(this.isBegun || (this.draft.base && this.value("spine")));
  }

  /** @param {Row} row @param {string} part */
  async start(row, part) {
    super.start(row, part);
    if (this.asked === row.capture) return;
    this.asked = row.capture;
    this.layout = null;
    this.isBegun = false;
    setText(this.foundText, "");
    /** @type {Layout} */ const layout = await getOrNull(`/api/pages/${row.page}/layout`);
    if (this.asked !== row.capture || !layout) return;
    this.layout = layout;
    const [left, right] = layout.widths_mm ?? [];
    setText(this.foundText, left === undefined ? t("layout.none")
      : t("layout.found", { left: number(left, 1), right: number(right, 1), sigma: number(Math.max(Math.ceil(layout.sigma_mm / TENTH), 1) * TENTH, 1) }));
  }

  begin() {
    if (!this.draft.base || this.value("spine")) return;
    this.isBegun = true;
    this.draft.changed(); // the scanner's picture comes, and with it the size of it
  }

  /** The spine that was found, in whole px of the picture; else one down its middle. */
  get first() {
    const { spine, frame } = this.layout ?? {};
    const { width, height } = this.viewer.page;
    if (spine && frame === "picture") return spine.map((point) => point.map(Math.round));
    return [INSET, 1 - INSET].map((part) => [Math.round(width / 2), Math.round(part * height)]);
  }

  /** Move the whole spine sideways by px of the picture: the one that was found, where none is drawn. @param {number} across */
  shift(across) {
    const points = this.value("spine") ?? (this.layout?.spine && this.first);
    if (points) this.take(points.map((/** @type {Point} */ [x, y]) => [Math.max(x + across, 0), y]));
    else this.begin();
  }

  /** @param {Point[]} points */
  take(points) {
    this.propose({ spine: points, ...(this.value("layout") === "whole" ? { layout: "split" } : {}) });
  }

  shown() {
    this.choice.show(this.value("layout"));
    const spine = this.value("spine");
    this.beginning.hidden = Boolean(spine);
    this.drawing.element.hidden = !spine;
    if (!this.viewer.page?.isScan || this.isStill || !this.isOnScan) {
      this.drawing.end();
      return;
    }
    this.drawing.start();
    if (this.isBegun && !spine) {
      this.isBegun = false;
      this.take(this.first);
    } else this.drawing.show(spine, "spine-line");
  }

  ended() {
    this.isBegun = false;
    this.drawing.end();
  }
}

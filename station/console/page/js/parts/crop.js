// What of a flat page is shown: to the edge of the paper, a margin beyond it, or a box between two corners.

import { h, segmented } from "../dom.js";
import { valueAt } from "../corrections.js";
import { field } from "../dialog.js";
import { Drawing } from "./drawing.js";
import { CorrectionTool } from "./tool.js";
import { t } from "../strings.js";

const KEYS = { 1: "paper", 2: "margin", 3: "box" };
const MM_PER_INCH = 25.4;
const FIRST_MM = 3; // a new margin
const MAX_MM = 100; // of a margin
const hundredth = (/** @type {number} */ value) => Math.round(100 * value) / 100;

export class CropTool extends CorrectionTool {
  /** @param {import("../draft.js").Draft} draft @param {import("./viewer.js").PageViewer} viewer */
  constructor(draft, viewer) {
    const choice = segmented(t("tool.crop"), Object.entries(KEYS).map(([key, name]) => [name, `${t(`crop.${name}`)} (${key})`]), (name) => this.choose(name));
    const input = h("input", { type: "number", min: 0, max: MAX_MM, step: 0.5, on: { change: () => { if (input.value !== "") this.setMargin(Number(input.value)); } } });
    const margin = field(t("crop.mm"), input);
    const drawing = new Drawing(viewer, { isClosed: false, least: 2, most: 2, changed: (points) => this.take(points) });
    super(draft, { name: "crop", fields: ["part.crop"], body: [choice.element, margin, drawing.element] });
    this.viewer = viewer;
    this.choice = choice;
    this.input = input;
    this.margin = margin;
    this.drawing = drawing;
    this.keys = Object.fromEntries(Object.entries(KEYS).map(([key, name]) => [key, () => this.choose(name)]));
  }

  get crop() {
    return this.value(this.paths[0]) ?? { mode: "paper" };
  }

  /** Where the upper left corner of the page that is shown is, in mm from that of the paper. */
  get corner() {
    const { mode, margin_mm: margin = 0, box } = valueAt(this.draft.base.restored, this.paths[0]) ?? {};
    return mode === "box" ? box.slice(0, 2) : [-margin, -margin];
  }

  /** @param {string} mode */
  choose(mode) {
    const { width, height } = this.viewer.page ?? {};
    if (mode === "margin") this.setMargin(FIRST_MM);
    else if (mode === "paper") this.propose({ [this.paths[0]]: { mode } });
    else if (width) this.take([[0, 0], [width - 1, height - 1]]);
  }

  /** @param {number} mm */
  setMargin(mm) {
    this.propose({ [this.paths[0]]: { mode: "margin", margin_mm: Math.min(Math.max(hundredth(mm), 0), MAX_MM) } });
  }

  /** @param {Point[]} pair */
  take([[left, top], [right, bottom]]) {
    const mm = (/** @type {number} */ px, /** @type {number} */ axis) => hundredth((px * MM_PER_INCH) / this.viewer.page.dpi + this.corner[axis]);
    const box = [mm(Math.min(left, right), 0), mm(top, 1), mm(Math.max(left, right) + 1, 0), mm(bottom + 1, 1)];
    this.propose({ [this.paths[0]]: { mode: "box", box } });
  }

  shown() {
    const { mode, margin_mm: margin, box } = this.crop;
    this.choice.show(mode);
    this.margin.hidden = mode !== "margin";
    this.input.value = String(margin ?? "");
    const isDrawn = mode === "box" && Boolean(this.viewer.page?.dpi) && !this.isStill;
    this.drawing.element.hidden = !isDrawn;
    if (!isDrawn) {
      this.drawing.end();
      return;
    }
    const px = (/** @type {number} */ mm, /** @type {number} */ axis) => Math.round(((mm - this.corner[axis]) * this.viewer.page.dpi) / MM_PER_INCH);
    const [left, top, right, bottom] = [px(box[0], 0), px(box[1], 1), px(box[2], 0) - 1, px(box[3], 1) - 1];
    this.drawing.start();
    this.drawing.show([[left, top], [right, bottom]], null, [[[[left, top], [right, top], [right, bottom], [left, bottom], [left, top]], "outline"]]);
  }

  ended() {
    this.drawing.end();
  }
}

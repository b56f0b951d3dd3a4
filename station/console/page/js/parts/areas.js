// The outline of a page, and areas of it, drawn on the scanner's picture.

import { button, h } from "../dom.js";
import { field } from "../dialog.js";
import { Drawing } from "./drawing.js";
import { CorrectionTool } from "./tool.js";
import { t } from "../strings.js";

const INSET = 0.05; // of the picture: a first outline, to be moved to the edges of the paper
const FIRST = 0.2; // of the picture: width of a new area
const SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]];
const MAX_POINTS = 200;
const WHAT = { 1: "remove", 2: "keep" };

/** A rectangle of whole px: its upper left corner, its width and height. @param {number} x @param {number} y @param {number} width @param {number} height */
function rectangle(x, y, width, height) {
  return SQUARE.map(([across, down]) => [Math.round(x + across * width), Math.round(y + down * height)]);
}

/** A tool that draws a closed line on the scanner's picture. */
class AreaTool extends CorrectionTool {
  /** @param {import("../draft.js").Draft} draft @param {import("./viewer.js").PageViewer} viewer @param {{name: string, fields: string[], body: Content[]}} options */
  constructor(draft, viewer, options) {
    const drawing = new Drawing(viewer, { isClosed: true, least: 3, most: MAX_POINTS, changed: (points) => this.take(points) });
    super(draft, { ...options, body: [...options.body, drawing.element] });
    this.viewer = viewer;
    this.drawing = drawing;
  }

  get isOnScan() {
    return true;
  }

  /** Take the points that were drawn. @param {Point[]} _points */
  take(_points) {}

  ended() {
    this.drawing.end();
  }

  /** Show a line and others where the scanner's picture is shown. @param {Point[]} points @param {string} kind @param {Line[]} [others] */
  showLine(points, kind, others = []) {
    if (this.viewer.page?.isScan && !this.isStill) {
      this.drawing.start();
      this.drawing.show(points, kind, others);
    } else this.drawing.end();
  }
}

export class OutlineTool extends AreaTool {
  /** @param {import("../draft.js").Draft} draft @param {import("./viewer.js").PageViewer} viewer */
  constructor(draft, viewer) {
    const begin = button(t("outline.draw"), { icon: "pencil", key: "d", click: () => this.begin() });
    super(draft, viewer, { name: "outline", fields: ["part.outline"], body: [begin] });
    this.beginning = begin;
    this.keys = { d: () => this.begin() };
  }

  begin() {
    const { width, height, isScan } = this.viewer.page ?? {};
    if (!isScan || this.value(this.paths[0])) return;
    this.take(rectangle(INSET * width, INSET * height, (1 - 2 * INSET) * width, (1 - 2 * INSET) * height));
  }

  /** @param {Point[]} points */
  take(points) {
    this.propose({ [this.paths[0]]: points });
  }

  shown() {
    const points = this.value(this.paths[0]) ?? null;
    this.beginning.hidden = Boolean(points);
    this.showLine(points, "outline");
  }
}

export class MaskTool extends AreaTool {
  /** @param {import("../draft.js").Draft} draft @param {import("./viewer.js").PageViewer} viewer */
  constructor(draft, viewer) {
    const adding = h("div", { class: "row" }, Object.entries(WHAT).map(([key, what]) =>
      button(t(`mask.${what}`), { icon: "plus", key, click: () => this.begin(what) })));
    const choice = h("select", { on: { change: () => { this.chosen = Number(choice.value); this.show(); } } });
    const choosing = h("div", { class: "drawing-panel" }, field(t("mask.chosen"), choice),
      button(t("mask.delete"), { icon: "x", click: () => this.replace([]) }));
    super(draft, viewer, { name: "mask", fields: ["part.masks"], body: [adding, choosing] });
    this.choice = choice;
    this.choosing = choosing;
    this.chosen = 0;
    this.keys = Object.fromEntries(Object.entries(WHAT).map(([key, what]) => [key, () => this.begin(what)]));
  }

  /** The areas of the page itself: those of rules add to them, and are not changed here. @param {Source[]} sources */
  given(sources) {
    return super.given(sources.filter(({ source }) => source === "page"), this.paths[0]);
  }

  /** @returns {Mask[]} */
  get masks() {
    return this.value(this.paths[0]) ?? [];
  }

  /** @param {string} what */
  begin(what) {
    const { width, height, isScan } = this.viewer.page ?? {};
    if (!isScan) return;
    const side = FIRST * width;
    this.chosen = this.masks.length;
    this.store([...this.masks, { what, polygon: rectangle((width - side) / 2, (height - side) / 2, side, side) }]);
  }

  /** @param {Point[]} polygon */
  take(polygon) {
    this.replace([{ ...this.masks[this.chosen], polygon }]);
  }

  /** Put others in the place of the chosen area. @param {Mask[]} masks */
  replace(masks) {
    this.store(this.masks.toSpliced(this.chosen, 1, ...masks));
  }

  /** @param {Mask[]} masks */
  store(masks) {
    this.propose({ [this.paths[0]]: masks.length ? masks : null });
  }

  shown() {
    const { masks } = this;
    this.chosen = Math.max(Math.min(this.chosen, masks.length - 1), 0);
    this.choosing.hidden = masks.length === 0;
    const names = masks.map(({ what }, at) => `${at + 1} · ${t(`mask.${what}`)}`);
    if (this.choice.dataset.names !== names.join()) this.choice.replaceChildren(...names.map((text, value) => h("option", { value, text })));
    this.choice.dataset.names = names.join();
    this.choice.value = String(this.chosen);
    const others = masks.filter((_, at) => at !== this.chosen).map(({ what, polygon }) => /** @type {Line} */ ([polygon, what]));
    this.showLine(masks[this.chosen]?.polygon ?? null, masks[this.chosen]?.what, others);
  }
}

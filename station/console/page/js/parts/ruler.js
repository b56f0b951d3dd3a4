// The ruler: two points on the page, and how far apart they are on the page, on the sheet in space and through space.

import { get } from "../api.js";
import { errorText } from "../notices.js";
import { button, h, set, setText } from "../dom.js";
import { number } from "../format.js";
import { t } from "../strings.js";

const MM_PER_INCH = 25.4;

/** A ruler on a viewer: `element` is its panel; `on` and `off` with the mode. */
export class Ruler {
  /** @param {import("./viewer.js").PageViewer} viewer */
  constructor(viewer) {
    this.viewer = viewer;
    /** @type {Position[]} */ this.points = [];
    this.clicked = (/** @type {{quick: boolean, position: Position}} */ { quick, position }) => { if (quick) this.put(this.viewer.toPage(position)); };
    this.redraw = () => this.draw();
    this.rows = ["page", "sheet", "chord"].map((name) => ({ name, value: h("dd", { text: "–" }) }));
    this.status = h("p", { class: "soft", role: "status", text: t("ruler.first") });
    this.element = h("section", { class: "tool-panel", "aria-label": t("tool.ruler") }, this.status,
      h("dl", { class: "figures" }, this.rows.map(({ name, value }) => h("div", {}, h("dt", { text: t(`ruler.${name}`) }), value))),
      h("div", { class: "row" }, button(t("ruler.here"), { icon: "crosshair", click: () => this.put(this.middle()) }),
        button(t("ruler.clear"), { icon: "x", kind: "quiet", click: () => this.clear() })));
    this.cross = h("span", { class: "crosshair", "aria-hidden": "true" });
    this.drawing = h("g", { class: "ruler" });
  }

  /** @param {Row} row @param {PageLeaf} leaf */
  start(row, leaf) {
    this.row = row;
    this.leaf = leaf;
    this.viewer.element.append(this.cross);
    this.viewer.over.append(this.drawing);
    this.viewer.viewer.addHandler("canvas-click", this.clicked);
    this.viewer.listeners.add(this.redraw);
    this.clear();
  }

  end() {
    this.viewer.viewer?.removeHandler("canvas-click", this.clicked);
    this.viewer.listeners.delete(this.redraw);
    this.cross.remove();
    this.drawing.remove();
  }

  middle() {
    const { clientWidth, clientHeight } = this.viewer.element;
    return this.viewer.toPage({ x: clientWidth / 2, y: clientHeight / 2 });
  }

  clear() {
    this.points = [];
    for (const { value } of this.rows) setText(value, "–");
    setText(this.status, t("ruler.first"));
    this.draw();
  }

  /** @param {Position} point */
  async put(point) {
    if (this.points.length === 2) this.clear();
    this.points.push(point);
    this.draw();
    if (this.points.length === 1) return setText(this.status, t("ruler.second"));
    const [one, two] = this.points.map(({ x, y }) => [x, y].map((value) => (value * MM_PER_INCH) / this.viewer.page.dpi));
    setText(this.status, t("ruler.measuring"));
    try {
      const query = new URLSearchParams({ x0: String(one[0]), y0: String(one[1]), x1: String(two[0]), y1: String(two[1]), leaf: this.leaf.prefix });
      this.showResult(await get(`/api/models/${this.row.restore}/measure?${query}`));
    } catch (error) {
      if (error.key === "not_recorded") this.showResult({ page_mm: Math.hypot(two[0] - one[0], two[1] - one[1]) }, "ruler.unrecorded");
      else setText(this.status, errorText(error));
    }
  }

  /** @param {Record<string, number>} found */
  showResult(found, words = "ruler.summary") {
    for (const { name, value } of this.rows) setText(value, `${name}_mm` in found ? `${number(found[`${name}_mm`], 2)} mm` : "–");
    setText(this.status, t(words));
  }

  draw() {
    const size = 7 / (this.viewer.page ? this.viewer.scale : 1); // px of the screen
    const dots = this.points.map(({ x, y }) => h("circle", { cx: x, cy: y, r: size }));
    const [one, two] = this.points;
    const line = two ? h("line", { x1: one.x, y1: one.y, x2: two.x, y2: two.y }) : null;
    this.drawing.replaceChildren(...[line?.cloneNode(), line, ...dots].filter(Boolean));
    if (line) set(this.drawing.firstElementChild, "class", "under");
  }
}

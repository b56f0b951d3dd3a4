// Before and after: the picture of the scanner laid over the page so that the same words come to lie near each other.

import { keyed } from "../api.js";
import { h, set } from "../dom.js";
import { loadModel } from "./model.js";
import { t } from "../strings.js";

const STEP = 0.02; // of the width, for one press of an arrow key

/**
 * The similarity that carries points of one picture to another's with the least squares: {a, b, x, y} with
 * x' = a x − b y + x, y' = b x + a y + y. Points are given flat: x, y, x, y, …
 * @param {Numbers | Float64Array} from @param {Numbers | Float64Array} to
 */
export function similarity(from, to) {
  const n = from.length / 2;
  let [fx, fy, tx, ty] = [0, 0, 0, 0];
  for (let at = 0; at < n; at += 1) {
    fx += from[2 * at] / n; fy += from[2 * at + 1] / n;
    tx += to[2 * at] / n; ty += to[2 * at + 1] / n;
  }
  let [dot, cross, square] = [0, 0, 0];
  for (let at = 0; at < n; at += 1) {
    const [x, y, u, v] = [from[2 * at] - fx, from[2 * at + 1] - fy, to[2 * at] - tx, to[2 * at + 1] - ty];
    dot += x * u + y * v; cross += x * v - y * u; square += x * x + y * y;
  }
  const [a, b] = [dot / (square || 1), cross / (square || 1)];
  return { a, b, x: tx - a * fx + b * fy, y: ty - b * fx - a * fy };
}

/** Positions on a picture in px, y down, out of texture coordinates with v upwards. @param {Numbers} uv @param {number} width @param {number} height */
function pixels(uv, width, height) {
  return Float64Array.from(uv, (value, at) => (at % 2 ? (1 - value) * height : value * width));
}

/** @param {Row} row @param {Shot} page @param {Position} original */
async function register(row, page, original) {
  const model = await loadModel(row.restore, "mesh").catch(() => /** @type {Model} */ (null));
  if (!model?.arrays.page_uv) return { a: page.width / original.x, b: 0, x: 0, y: 0 };
  return similarity(pixels(model.arrays.uv.values, original.x, original.y), pixels(model.arrays.page_uv.values, page.width, page.height));
}

/** The slider over a viewer; `show` compares a page with a layer, `end` takes it away. */
export class Compare {
  /** @param {import("./viewer.js").PageViewer} viewer */
  constructor(viewer) {
    this.viewer = viewer;
    this.at = 0.5;
    this.before = h("div", { class: "tiles before" });
    this.handle = h("div", { class: "compare-handle", role: "slider", tabindex: "0", "aria-label": t("compare.label"),
      "aria-valuemin": 0, "aria-valuemax": 100, "data-own-keys": "" }, h("span", { class: "compare-grip", "aria-hidden": "true", text: "◂ ▸" }));
    this.names = [h("span", { class: "compare-name left", text: t("compare.before") }), h("span", { class: "compare-name right", text: t("compare.after") })];
    this.handle.addEventListener("pointerdown", (event) => this.handle.setPointerCapture(event.pointerId));
    this.handle.addEventListener("pointermove", (event) => {
      if (!this.handle.hasPointerCapture(event.pointerId)) return;
      const box = this.viewer.element.getBoundingClientRect();
      this.move((event.clientX - box.left) / box.width);
    });
    this.handle.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -STEP, ArrowRight: STEP, Home: -1, End: 1 }[event.key];
      if (step) { event.preventDefault(); this.move(this.at + step); }
    });
  }

  /** @param {Row} row @param {Shot} page @param {string} layer @param {string} [prefix] */
  async show(row, page, layer, prefix = "") {
    this.end();
    await this.viewer.start();
    this.viewer.element.append(this.before, this.handle, ...this.names);
    this.move(this.at);
    this.following = this.viewer.follower(this.before);
    const { other } = this.following;
    const key = layer === "original" ? `${row.capture}/original` : `${row.restore}/${prefix}${layer}`;
    const item = await new Promise((done) => other.addTiledImage({ tileSource: keyed(`/api/pictures/${key}.dzi`), width: 1,
      success: (event) => done(/** @type {any} */ (event).item), error: () => done(null) }));
    if (item && layer === "original") await this.lay(item, row, page);
    this.viewer.moved();
    this.handle.dataset.ready = "true";
  }

  /** @param {import("openseadragon").TiledImage} item @param {Row} row @param {Shot} page */
  async lay(item, row, page) {
    const size = item.getContentSize();
    const { a, b, x, y } = await register(row, page, size);
    const scale = Math.hypot(a, b);
    const middle = [a * size.x / 2 - b * size.y / 2 + x, b * size.x / 2 + a * size.y / 2 + y];
    const corner = [middle[0] - scale * size.x / 2, middle[1] - scale * size.y / 2];
    item.setWidth((scale * size.x) / page.width, true);
    item.setRotation((Math.atan2(b, a) * 180) / Math.PI, true);
    item.setPosition(new this.viewer.osd.Point(corner[0] / page.width, corner[1] / page.width), true);
  }

  /** @param {number} at */
  move(at) {
    this.at = Math.min(Math.max(at, 0), 1);
    this.handle.style.left = `${this.at * 100}%`;
    this.before.style.clipPath = `inset(0 ${(1 - this.at) * 100}% 0 0)`;
    set(this.handle, "aria-valuenow", Math.round(this.at * 100));
  }

  end() {
    this.following?.end();
    this.following = null;
    for (const one of [this.before, this.handle, ...this.names]) one.remove();
    this.before.replaceChildren();
  }
}

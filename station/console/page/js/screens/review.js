// Review: a finished volume leaf by leaf, those that differ from their neighbours first, with one hand.

import { get } from "../api.js";
import { button, h, segmented, set, setText } from "../dom.js";
import { measure, number, pageName } from "../format.js";
import { setToolKey } from "../keys.js";
import { levelSign, measureName, verdictLights } from "../parts/verdict.js";
import { PageViewer } from "../parts/viewer.js";
import { attempt, on, press, select, store } from "../store.js";
import { t } from "../strings.js";

const BINS = 12; // of a histogram
const ZOOM = 1.5;
/** @type {[("width_mm" | "height_mm" | "sampling_ppi"), string][]} */ const SIZES = [["width_mm", "mm"], ["height_mm", "mm"], ["sampling_ppi", "ppi"]];
/** @type {Record<string, string>} */ const KEYS = { " ": "next", d: "next", ArrowRight: "next", a: "back", ArrowLeft: "back", s: "questionable", w: "earlier",
  e: "accept", x: "reject", m: "mark", q: "mark", "+": "in", "-": "out", 0: "fit" };
const BLOCKED = new Set(["r", "i", "p", "Enter"]); // here a key never starts the scanner, and acts on the leaf that is shown

/** @param {ReviewLeaf} leaf */
const isQuestionable = (leaf) => leaf.level === "amber" || leaf.level === "red" || !leaf.level;
const median = (/** @type {number[]} */ values) => values.toSorted((one, two) => one - two)[Math.floor(values.length / 2)];

class ReviewScreen {
  constructor() {
    this.viewer = new PageViewer();
    this.viewer.keepsZoom = true;
    this.lights = verdictLights();
    /** @type {ReviewLeaf[]} */ this.leaves = [];
    /** @type {ReviewLeaf[]} */ this.list = [];
    /** @type {ReviewLeaf} */ this.leaf = null;
    /** @type {ReviewLeaf} */ this.drawn = null;
    /** @type {(leaf: ReviewLeaf) => boolean} */ this.filter = null;
    this.filterName = "";
    this.order = "outliers";
    this.orders = segmented(t("strip.order"), [["outliers", t("review.outliers"), "arrow-down-wide-narrow"], ["volume", t("strip.volume"), "list-ordered"]],
      (key) => { this.order = key; this.sort(); });
    this.count = h("span", { class: "soft", role: "status" });
    this.title = h("h1", { class: "page-title" });
    this.sub = h("p", { class: "soft page-sub" });
    this.sign = h("div", { class: "sign-place" });
    this.charts = h("div", { class: "charts" });
    this.acts = h("div", { class: "actions" }, [["accept", "check", "e"], ["reject", "repeat-2", "x"], ["mark", "bookmark", "m"], ["questionable", "triangle-alert", "s"],
      ["back", "chevron-left", "a"], ["next", "chevron-right", "d"]].map(([name, icon, key]) => button(t(`review.${name}`), { icon, key, click: () => this.act(name) })));
    this.element = h("div", { class: "screen review-screen" },
      h("section", { class: "viewer", "aria-label": t("picture") }, h("div", { class: "viewer-head" }, this.orders.element, this.count), this.viewer.element),
      h("section", { class: "panel scrolling", "aria-label": t("page"), tabindex: "0" }, h("div", { class: "panel-head" }, h("div", {}, this.title, this.sub), this.sign),
        this.acts, this.lights.element, h("h2", { text: t("review.volume") }), this.charts));
    on("rows", () => { if (this.element.isConnected) this.load(); });
    on("row", () => { if (this.element.isConnected) this.show(); });
  }

  enter() {
    setToolKey((key) => this.key(key));
    return this.load();
  }

  leave() {
    setToolKey(null);
  }

  async load() {
    this.leaves = (await attempt(() => get("/api/review")))?.leaves ?? [];
    this.sort();
  }

  /** The leaves that the filter leaves, in their order; the one that is shown stays, where it is among them. */
  sort() {
    const found = this.filter ? this.leaves.filter(this.filter) : this.leaves;
    this.list = this.order === "volume" ? found : found.toSorted((one, two) => two.rank - one.rank);
    this.leaf = this.list.find(({ name }) => name === this.leaf?.name) ?? this.list[0] ?? null;
    this.orders.show(this.order);
    this.drawCharts();
    return this.show();
  }

  /** @param {string} key */
  key(key) {
    if (KEYS[key]) this.act(KEYS[key]);
    return Boolean(KEYS[key]) || BLOCKED.has(key);
  }

  /** @param {string} name */
  async act(name) {
    const at = this.list.indexOf(this.leaf);
    if (name === "next") this.go(this.list[at + 1]);
    else if (name === "back") this.go(this.list[at - 1]);
    else if (name === "questionable") this.go(this.list.slice(at + 1).find(isQuestionable));
    else if (name === "earlier") this.go(this.list.slice(0, Math.max(at, 0)).findLast(isQuestionable));
    else if (name === "in" || name === "out") this.viewer.zoom(name === "in" ? ZOOM : 1 / ZOOM);
    else if (name === "fit") this.viewer.fit();
    else if (this.leaf) {
      const { page } = this.leaf;
      if (name !== "mark") this.go(this.list[at + 1]);
      await press(name, { page });
    }
  }

  /** @param {ReviewLeaf} leaf */
  go(leaf) {
    if (!leaf) return;
    this.leaf = leaf;
    select(leaf.page);
    this.show();
  }

  async show() {
    const { leaf } = this;
    const row = leaf && store.rows.get(leaf.page);
    setText(this.count, t("review.count", { n: number(this.list.indexOf(leaf) + 1), all: number(this.list.length), questionable: number(this.list.filter(isQuestionable).length) }));
    setText(this.title, row ? [pageName(row), leaf.part !== "page" && t(`side.${leaf.part}`)].filter(Boolean).join(", ") : t("capture.none"));
    setText(this.sub, row ? [row.accepted && t("state.accepted"), row.state === "again" && t("state.again"), row.marked && t("state.marked"),
      leaf.width_mm && `${number(leaf.width_mm, 1)} × ${number(leaf.height_mm, 1)} mm`].filter(Boolean).join(" · ") : "");
    this.sign.replaceChildren(row ? levelSign({ ...row, level: leaf.level }) : "");
    this.lights.show(row ?? null, leaf?.checks.toSorted((one, two) => Number(one.level === "green") - Number(two.level === "green")) ?? null);
    set(this.element, "data-leaf", leaf?.name);
    if (this.isDrawing) return; // the one that is wanted by then comes next
    this.isDrawing = true;
    await this.viewer.start();
    this.viewer.viewer.canvas.removeAttribute("data-own-keys"); // a hand that moved the image with the mouse goes on with the same keys
    Object.assign(/** @type {any} */ (this.viewer.viewer).innerTracker, { keyDownHandler: null, keyHandler: null });
    /** @type {any} */ (this.viewer.viewer).preserveViewport = true; // else the first image of an empty world is fitted in
    while (this.leaf && this.drawn !== this.leaf) {
      this.drawn = this.leaf;
      const { event, layer, dpi, part } = this.drawn;
      await this.viewer.show({ key: `${event} ${part}`, dpi }, [{ event, layer }]);
    }
    this.isDrawing = false;
  }

  /** Sizes, resolution and checks of the volume: a bar shows its leaves alone, a second time all. */
  drawCharts() {
    const sizes = SIZES.map(([name, unit]) => {
      const values = this.leaves.map((leaf) => leaf[name]).filter((value) => value !== null);
      if (!values.length) return null;
      const [low, high] = [Math.min(...values), Math.max(...values)];
      const step = (high - low) / BINS || 1;
      const bin = (/** @type {ReviewLeaf} */ leaf) => (leaf[name] === null ? -1 : Math.min(Math.floor((leaf[name] - low) / step), BINS - 1));
      const counts = Array.from({ length: BINS }, (_, at) => this.leaves.filter((leaf) => bin(leaf) === at).length);
      return this.chart(`${t(`review.${name}`)} · ${t("review.median", { value: measure(median(values), unit) })}`, counts.map((n, at) =>
        [`${name} ${at}`, `${measure(low + at * step, "")}–${measure(low + (at + 1) * step, unit)}`, n, (leaf) => bin(leaf) === at]));
    });
    const bad = (/** @type {ReviewLeaf} */ leaf) => leaf.checks.filter(({ level }) => level === "amber" || level === "red").map(({ name }) => name);
    const names = [...new Set(this.leaves.flatMap(bad))];
    const checks = names.length ? this.chart(t("review.checks"), names.map((name) =>
      [name, measureName(name), this.leaves.filter((leaf) => bad(leaf).includes(name)).length, (leaf) => bad(leaf).includes(name)]), true) : null;
    this.charts.replaceChildren(...[checks, ...sizes].filter(Boolean));
  }

  /** @param {string} title @param {[string, string, number, (leaf: ReviewLeaf) => boolean][]} bars */
  chart(title, bars, isNamed = false) {
    const most = Math.max(...bars.map(([, , n]) => n), 1);
    return h("figure", { class: "chart" }, h("figcaption", { class: "soft", text: title }), h("div", { class: isNamed ? "bars named" : "bars" }, bars.map(([key, name, n, filter]) => {
      const bar = h("span", { class: "bar" });
      bar.style[isNamed ? "width" : "height"] = `${n ? Math.max((100 * n) / most, 4) : 0}%`;
      return h("button", { type: "button", class: "bar-button", "aria-pressed": String(this.filterName === key), "aria-label": `${name}: ${number(n)}`, title: `${name}: ${number(n)}`,
        on: { click: () => this.choose(key, filter) } }, isNamed ? h("span", { text: `${name} ${number(n)}` }) : null, bar);
    })));
  }

  /** @param {string} key @param {(leaf: ReviewLeaf) => boolean} filter */
  choose(key, filter) {
    const isOff = this.filterName === key;
    this.filterName = isOff ? "" : key;
    this.filter = isOff ? null : filter;
    this.sort();
    if (this.leaf) select(this.leaf.page);
  }
}

/** The screen, made once. */
export default function reviewScreen() {
  return new ReviewScreen();
}

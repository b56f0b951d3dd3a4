// The picture of a page, to be zoomed to its pixels: tiles of the server in OpenSeadragon, and an SVG over them.

import { keyed } from "../api.js";
import { h, set, setText } from "../dom.js";
import { number, percent } from "../format.js";
import { t } from "../strings.js";

const LIBRARY = "/page/vendor/openseadragon/openseadragon.min.js";
const MM_PER_INCH = 25.4;
const MARGIN = 0.03; // around the page, in its widths
const BAR_PX = 140; // the scale bar is as long as this at most, and a round number of mm
/** @type {Promise<typeof import("openseadragon")>} */ let library;

function load() {
  library ??= new Promise((done, failed) => {
    // It would add a style sheet inline, which the policy forbids, unless it finds this element, which is none.
    const none = document.createElementNS("urn:none", "style");
    none.setAttribute("data-openseadragon-mobile-css", "true");
    document.head.append(none);
    document.head.append(h("script", { src: LIBRARY, on: { load: () => done(globalThis.OpenSeadragon), error: () => failed(new Error("OpenSeadragon")) } }));
  });
  return library;
}

/** @param {typeof import("openseadragon")} OpenSeadragon @param {HTMLElement} element @param {string} label */
function open(OpenSeadragon, element, label) {
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const viewer = OpenSeadragon({ element, drawer: "canvas", prefixUrl: "", showNavigationControl: false, animationTime: still ? 0 : 0.5,
    gestureSettingsMouse: { clickToZoom: false, dblClickToZoom: true }, gestureSettingsTouch: { clickToZoom: false },
    maxZoomPixelRatio: 16, minZoomImageRatio: 0.5, visibilityRatio: 0.3, imageSmoothingEnabled: true, preserveImageSizeOnResize: false });
  viewer.canvas.setAttribute("aria-label", label);
  viewer.canvas.setAttribute("role", "application");
  viewer.canvas.setAttribute("aria-roledescription", t("viewer.role"));
  viewer.canvas.setAttribute("data-own-keys", "");
  return viewer;
}

/** A viewer of layers of one size; `ready` resolves to what the other parts work with. */
export class PageViewer {
  constructor() {
    this.base = h("div", { class: "tiles" });
    this.over = h("g", {});
    this.svg = h("svg", { class: "over", "aria-hidden": "true" }, this.over);
    this.bar = h("span", { class: "scale-bar" });
    this.zoomed = h("span", { class: "zoomed" });
    this.element = h("div", { class: "page-viewer" }, this.base, this.svg, this.bar, this.zoomed);
    /** @type {Set<() => void>} */ this.listeners = new Set();
    /** @type {Map<string, import("openseadragon").TiledImage>} */ this.layers = new Map();
    /** @type {typeof import("openseadragon")} */ this.osd = undefined;
    /** @type {import("openseadragon").Viewer} */ this.viewer = undefined;
    this.keepsZoom = false; // from one page to the next
    this.hasFitted = false;
    /** @type {Promise<void>} */ this.shown = undefined;
    /** @type {Shot} */ this.page = null; // {key, width, height, dpi, isScan}: without a size, that of its lowest layer
  }

  async start() {
    this.osd ??= await load();
    if (this.viewer) return;
    this.viewer = open(this.osd, this.base, t("viewer.label"));
    for (const event of /** @type {const} */ (["animation", "resize", "open", "update-viewport"])) this.viewer.addHandler(event, () => this.moved());
  }

  /** Show the layers of a page from the lowest up: [{event, layer, opacity}]; others are taken away. @param {Shot} page @param {Picture[]} layers */
  show(page, layers) {
    this.shown = (this.shown ?? Promise.resolve()).then(() => this.put(page, layers)); // one after the other
    return this.shown;
  }

  /** @param {Shot} page @param {Picture[]} layers */
  async put(page, layers) {
    await this.start();
    const wanted = new Map(layers.map((one) => [`${one.event}/${one.layer}`, one]));
    const other = this.page?.key !== page.key;
    for (const [key, item] of this.layers) if (!wanted.has(key)) this.remove(key, item);
    let index = 0;
    for (const [key, one] of wanted) {
      if (!this.layers.has(key)) this.layers.set(key, await this.add(key, one, index));
      this.layers.get(key)?.setOpacity(one.opacity ?? 1);
      index += 1;
    }
    const size = page.width ? null : [...this.layers.values()][0]?.getContentSize();
    this.page = size ? { ...page, width: size.x, height: size.y } : page;
    set(this.element, "data-scan", Boolean(page.isScan));
    if (other && !(this.keepsZoom && this.hasFitted)) this.fit(true);
    this.hasFitted = true;
    this.moved();
  }

  /** @param {string} key @param {Picture} options @param {number} index */
  add(key, { opacity = 1 }, index) {
    return new Promise((done) => {
      this.viewer.addTiledImage({ tileSource: keyed(`/api/pictures/${key}.dzi`), opacity, index, width: 1,
        success: (event) => done(/** @type {any} */ (event).item), error: () => done(null) });
    });
  }

  /** @param {string} key @param {import("openseadragon").TiledImage} item */
  remove(key, item) {
    this.layers.delete(key);
    if (item) this.viewer.world.removeItem(item);
  }

  /** Where pixel (x, y) of the page lies in the element, in px. @param {number} x @param {number} y */
  toScreen(x, y) {
    const { width } = this.page;
    return this.viewer.viewport.viewportToViewerElementCoordinates(new this.osd.Point(x / width, y / width));
  }

  /** The pixel of the page below a point of the element. @param {Position} point */
  toPage(point) {
    const found = this.viewer.viewport.viewerElementToViewportCoordinates(new this.osd.Point(point.x, point.y));
    return { x: found.x * this.page.width, y: found.y * this.page.width };
  }

  /** Screen px for one pixel of the page. */
  get scale() {
    return this.toScreen(1000, 0).distanceTo(this.toScreen(0, 0)) / 1000;
  }

  /** Turn what is shown by degrees clockwise; by a quarter or more it is fitted in again. @param {number} degrees */
  turn(degrees) {
    const before = this.viewer.viewport.getRotation();
    if (Math.abs(before - degrees) < 1e-6) return;
    this.viewer.viewport.setRotation(degrees, true);
    if (Math.abs(before - degrees) >= 45) this.fit(true);
    this.moved();
  }

  moved() {
    if (!this.page?.width || !this.viewer.world.getItemCount()) return;
    const { x, y } = this.toScreen(0, 0);
    this.over.setAttribute("transform", `translate(${x} ${y}) rotate(${this.viewer.viewport.getRotation()}) scale(${this.scale})`);
    this.drawScale();
    for (const act of this.listeners) act();
  }

  drawScale() {
    setText(this.zoomed, t("viewer.zoom", { share: percent(this.scale) }));
    this.bar.hidden = !this.page.dpi;
    if (!this.page.dpi) return;
    const px = (this.scale * this.page.dpi) / MM_PER_INCH; // of the screen, for one mm
    const power = 10 ** Math.floor(Math.log10(BAR_PX / px));
    const length = [5, 2, 1].find((one) => one * power * px <= BAR_PX) * power;
    this.bar.style.width = `${length * px}px`;
    setText(this.bar, `${number(length, 2)} mm`);
  }

  /** @param {number} factor */
  zoom(factor) {
    this.viewer?.viewport.zoomBy(factor).applyConstraints();
  }

  /** Show the whole page, with a margin. */
  fit(immediately = false) {
    if (!this.viewer || !this.page?.width) return;
    const [width, height] = [1, this.page.height / this.page.width];
    const angle = (this.viewer.viewport.getRotation() * Math.PI) / 180;
    const [cos, sin] = [Math.abs(Math.cos(angle)), Math.abs(Math.sin(angle))];
    const [across, down] = [width * cos + height * sin + 2 * MARGIN, width * sin + height * cos + 2 * MARGIN];
    this.viewer.viewport.fitBounds(new this.osd.Rect((width - across) / 2, (height - down) / 2, across, down), immediately);
  }

  pixels() {
    this.viewer?.viewport.zoomTo(this.viewer.viewport.getZoom() / this.scale / devicePixelRatio);
  }

  /** Move to a rectangle of the page, in its pixels. @param {Word} word @param {number} [margin] */
  reveal({ x, y, w, h: tall }, margin = 6) {
    const grown = [x - w * margin, y - tall * margin, w * (1 + 2 * margin), tall * (1 + 2 * margin)].map((one) => one / this.page.width);
    this.viewer?.viewport.fitBounds(new this.osd.Rect(...grown));
  }

  /** A second viewer that follows this one, for what is compared with the page. @param {HTMLElement} element */
  follower(element) {
    const other = open(this.osd, element, t("compare.before"));
    other.setMouseNavEnabled(false);
    other.canvas.setAttribute("tabindex", "-1");
    const follow = () => {
      const { viewport } = this.viewer;
      other.viewport.zoomTo(viewport.getZoom(true), null, true);
      other.viewport.panTo(viewport.getCenter(true), true);
    };
    this.listeners.add(follow);
    return { other, end: () => { this.listeners.delete(follow); other.destroy(); } };
  }
}

// The 3D view of a page: what it shows, turning it, and the page falling flat.

import { get, keyed } from "../api.js";
import { button, h, icon, placeholder, segmented, set, setIcon, setText } from "../dom.js";
import { number } from "../format.js";
import { errorText } from "../notices.js";
import { t } from "../strings.js";
import { loadModel } from "./model.js";
import { Orbit } from "./orbit.js";
import { PointCloud } from "./points.js";

const KINDS = [["texture", "image"], ["points", "scan-line"], ["mesh", "box"], ["strain", "layers"], ["flatten", "arrow-down-to-line"]];
const FALL_MS = 4000; // of the animation, from the sheet as measured to the plane
const REST_MS = 1200; // that it stays flat before it begins again
const TURN_MS = 16_000; // of one turn
const PALETTE = ["#1c488c", "#f2f2f2", "#8c1c1c"]; // where the server has no scale

/** The view; `show(row, leaf)` loads what is chosen, `leave` stops it. */
export class ModelView {
  constructor() {
    this.kind = "texture";
    /** @type {Row} */ this.row = null;
    /** @type {PageLeaf} */ this.leaf = null;
    /** @type {typeof import("./scene.js")} */ this.library = undefined;
    /** @type {import("./scene.js").Scene} */ this.scene = undefined;
    /** @type {Float32Array[]} */ this.frames = null;
    /** @type {Float32Array} */ this.bent = null;
    /** @type {PointCloud} */ this.cloud = null;
    /** @type {number} */ this.started = null;
    /** @type {number} */ this.before = undefined;
    this.waiting = 0;
    this.playing = false;
    this.canvas = h("canvas", { class: "model-canvas" });
    this.dots = h("canvas", { class: "model-canvas", hidden: true });
    this.stage = h("div", { class: "model-stage", tabindex: "0", role: "application", "aria-roledescription": t("model.role"), "data-own-keys": "", "aria-label": t("model.label") },
      this.canvas, this.dots);
    this.orbit = new Orbit(this.stage, () => this.dirty());
    this.kinds = segmented(t("model.kinds"), KINDS.map(([name, picture]) => [name, t(`model.${name}`), picture]), (kind) => { this.kind = kind; this.load(); });
    this.status = h("p", { class: "model-status", role: "status" });
    this.slider = h("input", { type: "range", min: 0, max: 1, step: 0.001, value: 0, "aria-label": t("model.fall"), "data-own-keys": "",
      on: { input: () => { this.play(false); this.fall(Number(this.slider.value)); } } });
    this.player = h("button", { class: "button square", type: "button", on: { click: () => this.play(!this.playing) } }, icon("play"));
    this.empty = h("div", { class: "model-empty", hidden: true });
    this.element = h("div", { class: "model-view" }, this.stage, this.empty, this.status,
      h("div", { class: "model-controls" }, this.kinds.element, this.player, this.slider,
        button("", { icon: "rotate-ccw", kind: "square quiet", label: t("model.reset"), click: () => this.orbit.reset() })));
    this.observer = new ResizeObserver(() => { this.scene?.resize(); this.dirty(); });
    this.observer.observe(this.stage);
    this.play(false);
  }

  /** @param {Row} row @param {PageLeaf} leaf */
  async show(row, leaf) {
    this.row = row;
    this.leaf = leaf;
    this.stage.hidden = false;
    try {
      this.library ??= await import("./scene.js");
      this.scene ??= new this.library.Scene(this.canvas);
    } catch {
      return this.fail(t("model.none"), t("model.none.text"));
    }
    this.scene.surround();
    this.scene.resize();
    return this.load();
  }

  async load() {
    const [row, leaf, kind] = [this.row, this.leaf, this.kind];
    this.kinds.show(kind);
    this.slider.hidden = kind !== "flatten";
    this.empty.hidden = true;
    set(this.player, "aria-label", t(kind === "flatten" ? "model.play.fall" : "model.play.turn"));
    setText(this.status, t("model.loading"));
    this.frames = null;
    this.canvas.hidden = kind === "points";
    this.dots.hidden = kind !== "points";
    try {
      await this.drawer(kind)(row, () => row === this.row && leaf === this.leaf && kind === this.kind);
    } catch (error) {
      if (row === this.row && leaf === this.leaf) this.offer(error);
    }
    this.dirty();
  }

  /** What draws a kind of the model. @param {string} kind @returns {(row: Row, isWanted: () => boolean) => Promise<void>} */
  drawer(kind) {
    const drawers = /** @type {Record<string, (row: Row, isWanted: () => boolean) => Promise<void>>} */ ({ texture: this.drawTexture,
      points: this.drawPoints, mesh: this.drawMesh, strain: this.drawStrain, flatten: this.drawFlatten });
    return drawers[kind].bind(this);
  }

  /** @param {Model} model */
  async image(model) {
    const image = new Image();
    image.src = keyed(model.texture);
    await image.decode();
    return image;
  }

  /** @param {Row} row @param {() => boolean} wanted */
  async drawPoints(row, wanted) {
    const model = await loadModel(row.capture, "scan");
    const { vertices, uv } = model.arrays;
    const colours = model.texture && uv ? this.library.sampled(uv.values, this.library.pixelsOf(await this.image(model)))
      : new Uint8Array(vertices.values.length).fill(200);
    if (!wanted()) return;
    this.cloud = new PointCloud(this.dots, vertices.values, colours);
    setText(this.status, t("model.summary.points", { n: number(vertices.shape[0]) }));
  }

  async drawMesh(/** @type {Row} */ row, /** @type {() => boolean} */ wanted, look = /** @type {(model: Model) => Promise<Look>} */ (async () => ({ wire: true }))) {
    const model = await loadModel(row.restore, "mesh", this.leaf.prefix);
    const chosen = await look(model);
    if (!wanted()) return;
    this.scene.clear();
    this.scene.sheet(model.arrays.vertices.values.slice(), model.arrays.faces.values, chosen);
    setText(this.status, t("model.summary.mesh", { n: number(model.arrays.vertices.shape[0]), m: number(model.arrays.faces.shape[0]) }));
  }

  /** @param {Row} row @param {() => boolean} wanted */
  drawTexture(row, wanted) {
    return this.drawMesh(row, wanted, async (model) => (model.texture ? { uv: model.arrays.uv.values, image: await this.image(model) } : {}));
  }

  /** @param {Row} row @param {() => boolean} wanted */
  drawStrain(row, wanted) {
    return this.drawMesh(row, wanted, async (model) => {
      const scale = await get(`/api/pictures/${row.restore}/strain/scale?leaf=${this.leaf.prefix}`).catch(() => ({ colours: PALETTE, end: model.strain_end }));
      return { colours: this.library.scaled(model.arrays.strain.values, model.strain_end ?? scale.end, scale.colours) };
    });
  }

  /** The recorded steps of the solver; where none were kept, straight from the sheet in space to its flat positions. @param {Row} row @param {() => boolean} wanted */
  async drawFlatten(row, wanted) {
    const recorded = await loadModel(row.restore, "steps", this.leaf.prefix).catch(() => /** @type {Model} */ (null));
    const model = recorded ?? await loadModel(row.restore, "mesh", this.leaf.prefix);
    const frames = recorded ? framesOf(recorded.arrays.positions) : [model.arrays.vertices.values, lifted(model.arrays.flat.values)];
    const image = model.texture ? await this.image(model) : null;
    if (!wanted()) return;
    this.scene.clear();
    this.scene.sheet(frames[0].slice(), model.arrays.faces.values, { uv: model.arrays.uv.values, image });
    this.frames = frames;
    setText(this.status, recorded ? t("model.summary.steps", { n: number(frames.length) }) : t("model.summary.straight"));
    this.fall(0);
    this.play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  }

  /** @param {number} share */
  fall(share) {
    if (!this.frames) return;
    this.slider.value = String(share);
    this.bent = this.library.between(this.frames, share, this.bent?.length === this.frames[0].length ? this.bent : new Float32Array(this.frames[0].length));
    this.scene.bend(this.bent);
    this.dirty();
  }

  /** @param {boolean} playing */
  play(playing) {
    this.playing = playing;
    setIcon(this.player.firstElementChild, playing ? "pause" : "play");
    set(this.player, "aria-pressed", String(playing));
    this.started = null;
    if (playing) this.dirty();
  }

  dirty() {
    this.waiting ||= requestAnimationFrame((now) => this.frame(now));
  }

  /** @param {number} now */
  frame(now) {
    this.waiting = 0;
    if (!this.scene || !this.element.isConnected) return;
    if (this.playing) this.advance(now);
    const drawn = this.kind === "points" ? this.cloud : this.scene;
    drawn?.draw(this.orbit.eye(drawn.radius, this.stage.clientWidth / (this.stage.clientHeight || 1)));
  }

  /** @param {number} now */
  advance(now) {
    this.started ??= now;
    const past = now - this.started;
    if (this.kind === "flatten") this.fall(Math.min((past % (FALL_MS + REST_MS)) / FALL_MS, 1));
    else this.orbit.rotate(((now - (this.before ?? now)) / TURN_MS) * 2 * Math.PI, 0);
    this.before = past ? now : undefined;
  }

  leave() {
    this.play(false);
    this.before = undefined;
  }

  /** @param {string} title @param {Content} text @param {Content[]} actions */
  fail(title, text, ...actions) {
    setText(this.status, "");
    this.empty.hidden = false;
    this.empty.replaceChildren(placeholder("model", title, text, ...actions));
  }

  /** @param {import("../api.js").ApiError} error */
  offer(error) {
    if (error.key !== "not_recorded") return this.fail(t("model.none"), errorText(error));
    const points = button(t("model.unrecorded.points"), { icon: "scan-line", click: () => { this.kind = "points"; this.load(); } });
    return this.fail(t("model.unrecorded"), t("model.unrecorded.text"), points);
  }
}

/** @param {Model["arrays"][string]} options */
function framesOf({ values, shape }) {
  const size = shape[1] * shape[2];
  return Array.from({ length: shape[0] }, (_, at) => values.subarray(at * size, (at + 1) * size));
}

/** @param {Float32Array} flat */
function lifted(flat) {
  const positions = new Float32Array((flat.length / 2) * 3);
  let [x, y] = [0, 0];
  for (let at = 0; at < flat.length; at += 2) { x += flat[at] / (flat.length / 2); y += flat[at + 1] / (flat.length / 2); }
  for (let at = 0; at < flat.length / 2; at += 1) positions.set([flat[2 * at] - x, flat[2 * at + 1] - y, 0], 3 * at);
  return positions;
}

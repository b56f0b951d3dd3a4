// Points that are drawn on the scanner's picture: dragged by mouse and touch, moved by keys, added and taken away.

import { button, h, set, setText } from "../dom.js";
import { field } from "../dialog.js";
import { t } from "../strings.js";

/** @type {Record<string, number[]>} */ const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }; // px of the picture
export const FAR = 10; // of them at once, with Shift

const clamp = (/** @type {number} */ value, /** @type {number} */ low, /** @type {number} */ high) => Math.min(Math.max(value, low), high);

/** Where a point is to be put into a line: after the start of the side that is nearest to it. @param {Point[]} points @param {boolean} isClosed @param {Point} point */
export function sideNearest(points, isClosed, [x, y]) {
  const sides = isClosed ? points.length : points.length - 1;
  let [best, least] = [0, Infinity];
  for (let at = 0; at < sides; at += 1) {
    const [[ax, ay], [bx, by]] = [points[at], points[(at + 1) % points.length]];
    const [dx, dy] = [bx - ax, by - ay];
    const part = clamp(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1), 0, 1);
    const distance = Math.hypot(ax + part * dx - x, ay + part * dy - y);
    if (distance < least) [best, least] = [at, distance];
  }
  return best;
}

/**
 * A line over a viewer, closed or open. `changed` gets its points after each change; `least`, `most`: of its points. An open
 * line runs from head to tail: each of its points stays below the one before.
 */
export class Drawing {
  /** @param {import("./viewer.js").PageViewer} viewer @param {{isClosed: boolean, least: number, most: number, changed: (points: Point[]) => unknown}} options */
  constructor(viewer, { isClosed, least, most, changed }) {
    this.viewer = viewer;
    this.isClosed = isClosed;
    this.least = least;
    this.most = most;
    this.changed = changed;
    /** @type {Point[]} */ this.points = null;
    /** @type {Line[]} */ this.others = [];
    /** @type {string} */ this.kind = null;
    this.at = 0;
    this.placed = () => this.place();
    this.clicked = (/** @type {{quick: boolean, position: Position}} */ { quick, position }) => {
      if (quick && this.points) this.insert(Object.values(this.viewer.toPage(position)));
    };
    this.shapes = h("g", { class: "drawing" });
    this.handles = h("div", { class: "handles", role: "group", "aria-label": t("drawing.points") });
    this.said = h("p", { class: "soft", role: "status" });
    this.places = [0, 1].map((axis) => h("input", { type: "number", step: 1, min: 0,
      on: { change: ({ target }) => { if (target.value !== "") this.moveTo(this.at, this.points[this.at].with(axis, Number(target.value))); } } }));
    this.element = h("div", { class: "drawing-panel" }, this.said,
      h("div", { class: "pair" }, field(t("drawing.x"), this.places[0]), field(t("drawing.y"), this.places[1])),
      h("div", { class: "row", hidden: least === most }, button(t("drawing.add"), { icon: "plus", key: "+", click: () => this.add(this.at) }),
        button(t("drawing.remove"), { icon: "x", key: "-", click: () => this.remove(this.at) })),
      h("p", { class: "hint", text: t(least === most ? "drawing.keys" : "drawing.more") }));
  }

  start() {
    if (this.isOn) return;
    this.isOn = true;
    this.viewer.over.append(this.shapes);
    this.viewer.element.append(this.handles);
    this.viewer.viewer.addHandler("canvas-click", this.clicked);
    this.viewer.listeners.add(this.placed);
  }

  end() {
    if (!this.isOn) return;
    this.isOn = false;
    this.viewer.viewer.removeHandler("canvas-click", this.clicked);
    this.viewer.listeners.delete(this.placed);
    this.shapes.remove();
    this.handles.remove();
  }

  /** Show a line, null for none, and others that are not changed: [[points, kind]]. kind: null for points alone. @param {Point[]} points @param {string} kind @param {Line[]} [others] */
  show(points, kind, others = []) {
    this.points = points;
    this.kind = kind;
    this.others = others;
    this.at = Math.min(this.at, (points?.length ?? 1) - 1);
    this.draw();
  }

  draw() {
    /** @type {Line[]} */ const all = this.points && this.kind ? [...this.others, [this.points, this.kind]] : this.others;
    const drawn = (/** @type {Line} */ [points, kind], /** @type {boolean} */ under) => h(this.isClosed ? "polygon" : "polyline", { points: points.join(" "), class: under ? "under" : kind });
    this.shapes.replaceChildren(...all.map((one) => drawn(one, true)), ...all.map((one) => drawn(one, false)));
    const count = this.points?.length ?? 0;
    while (this.handles.children.length < count) this.handles.append(this.handle(this.handles.children.length));
    while (this.handles.children.length > count) this.handles.lastChild.remove();
    this.element.hidden = count === 0;
    this.place();
    this.describe();
  }

  place() {
    if (!this.points || !this.viewer.page?.width) return;
    [...this.handles.children].forEach((element, at) => {
      const { x, y } = this.viewer.toScreen(this.points[at][0], this.points[at][1]);
      /** @type {HTMLElement} */ (element).style.transform = `translate(${x}px, ${y}px)`;
    });
  }

  describe() {
    const { length } = this.points ?? [];
    [...this.handles.children].forEach((element, at) => {
      const [x, y] = this.points[at];
      set(element, "aria-label", t("drawing.at", { n: at + 1, of: length, x, y }));
      set(element, "data-chosen", at === this.at);
    });
    if (!length) return;
    const [x, y] = this.points[this.at];
    setText(this.said, t("drawing.at", { n: this.at + 1, of: length, x, y }));
    this.places.forEach((input, axis) => { input.value = String([x, y][axis]); });
  }

  /** @param {number} at */
  handle(at) {
    /** @type {HTMLElement} */ const element = h("button", { class: "handle", type: "button", on: {
      focus: () => { this.at = at; this.describe(); },
      keydown: (event) => this.key(at, event),
      pointerdown: (event) => this.grab(at, element, event),
      pointermove: (event) => { if (element.hasPointerCapture(event.pointerId)) this.drag(at, event); },
      pointerup: () => this.drop(),
      pointercancel: () => this.drop(),
    } });
    return element;
  }

  /** @param {number} at @param {KeyboardEvent} event */
  key(at, event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const step = STEPS[event.key];
    const far = event.shiftKey ? FAR : 1;
    if (step) this.moveTo(at, this.points[at].map((value, axis) => value + far * step[axis]));
    else if (event.key === "+" || event.key === "Insert") this.add(at);
    else if (event.key === "-" || event.key === "Delete") this.remove(at);
    else return;
    event.preventDefault();
  }

  /** @param {number} at @param {HTMLElement} element @param {PointerEvent} event */
  grab(at, element, event) {
    element.setPointerCapture(event.pointerId);
    element.focus();
    this.held = { from: this.points[at], x: event.clientX, y: event.clientY };
    event.preventDefault();
  }

  /** @param {number} at @param {PointerEvent} event */
  drag(at, event) {
    if (!this.held) return;
    const { from, x, y } = this.held;
    const { scale } = this.viewer;
    this.moveTo(at, [from[0] + (event.clientX - x) / scale, from[1] + (event.clientY - y) / scale], false);
  }

  drop() {
    if (this.held) this.changed(this.points);
    this.held = null;
  }

  /** Move a point to whole px of the picture; it stays in the picture, and in an open line between its neighbours. @param {number} at @param {Point} point @param {boolean} [isDone] */
  moveTo(at, [x, y], isDone = true) {
    const { width, height } = this.viewer.page;
    const ends = this.isClosed ? [] : [this.points[at - 1], this.points[at + 1]];
    const [top, bottom] = [ends[0] ? ends[0][1] + 1 : 0, ends[1] ? ends[1][1] - 1 : height - 1];
    this.points = this.points.with(at, [clamp(Math.round(x), 0, width - 1), clamp(Math.round(y), top, bottom)]);
    this.at = at;
    this.draw();
    if (isDone) this.changed(this.points);
  }

  /** Add a point in the middle of the side that follows a point. @param {number} at */
  add(at) {
    const start = !this.isClosed && at === this.points.length - 1 ? at - 1 : at;
    const [[ax, ay], [bx, by]] = [this.points[start], this.points[(start + 1) % this.points.length]];
    this.put(start + 1, [(ax + bx) / 2, (ay + by) / 2]);
  }

  /** @param {Point} point */
  insert(point) {
    this.put(sideNearest(this.points, this.isClosed, point) + 1, point);
  }

  /** @param {number} at @param {Point} point */
  put(at, point) {
    if (this.points.length >= this.most) return;
    this.points = this.points.toSpliced(at, 0, point);
    this.draw();
    this.moveTo(at, point);
    this.focus(at);
  }

  /** @param {number} at */
  focus(at) {
    /** @type {HTMLElement} */ (this.handles.children[at]).focus();
  }

  /** @param {number} at */
  remove(at) {
    if (this.points.length <= this.least) return setText(this.said, t("drawing.least", { n: this.least }));
    this.points = this.points.toSpliced(at, 1);
    this.at = Math.min(at, this.points.length - 1);
    this.draw();
    this.focus(this.at);
    return this.changed(this.points);
  }
}

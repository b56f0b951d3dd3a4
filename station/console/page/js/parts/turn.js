// Quarter turns and a fine angle of one part, shown at once by turning the picture that is there.

import { button, h } from "../dom.js";
import { valueAt } from "../corrections.js";
import { field } from "../dialog.js";
import { CorrectionTool } from "./tool.js";
import { t } from "../strings.js";

const MAX_DEG = 45;
const FINE_DEG = 0.1; // one press of an arrow key: 0.4 mm at the end of a line of 240 mm
const MM_PER_INCH = 25.4;
const GRID_MM = 10;

export class TurnTool extends CorrectionTool {
  /** @param {import("../draft.js").Draft} draft @param {import("./viewer.js").PageViewer} viewer */
  constructor(draft, viewer) {
    const input = h("input", { type: "number", min: -MAX_DEG, max: MAX_DEG, step: FINE_DEG,
      on: { change: () => { if (input.value !== "") this.rotate(Number(input.value)); } } });
    const quarters = h("div", { class: "row" }, button(t("turn.left"), { key: ",", click: () => this.quarter(-1) }),
      button(t("turn.right"), { key: ".", click: () => this.quarter(1) }));
    super(draft, { name: "turn", fields: ["part.turn", "part.rotate_deg"], body: [quarters, field(t("turn.deg"), input, t("turn.keys"))] });
    this.grid = h("div", { class: "turn-grid", "aria-hidden": "true" });
    this.input = input;
    this.viewer = viewer;
    this.drawGrid = () => {
      const px = (GRID_MM * this.viewer.scale * this.viewer.page.dpi) / MM_PER_INCH;
      this.grid.style.backgroundSize = `${px}px ${px}px`;
    };
    this.keys = { ",": () => this.quarter(-1), ".": () => this.quarter(1),
      ArrowLeft: (/** @type {KeyboardEvent} */ event) => this.rotate(this.angle - (event.shiftKey ? 1 : FINE_DEG)),
      ArrowRight: (/** @type {KeyboardEvent} */ event) => this.rotate(this.angle + (event.shiftKey ? 1 : FINE_DEG)) };
  }

  get angle() {
    return this.value(this.paths[1]) ?? 0;
  }

  /** @param {number} step */
  quarter(step) {
    this.propose({ [this.paths[0]]: ((this.value(this.paths[0]) ?? 0) + step + 4) % 4 });
  }

  /** @param {number} degrees */
  rotate(degrees) {
    const within = Math.min(Math.max(degrees, -MAX_DEG), MAX_DEG);
    this.propose({ [this.paths[1]]: Math.round(100 * within) / 100 + 0 });
  }

  /** How far the page is to be turned beyond what the picture shows, in degrees clockwise. */
  get beyond() {
    if (this.isStill) return 0;
    const [turn, angle] = this.paths.map((path) => (this.value(path) ?? 0) - (valueAt(this.draft.base.restored, path) ?? 0));
    return 90 * turn + angle;
  }

  shown() {
    this.input.value = String(this.angle);
    if (!this.viewer.page) return;
    this.viewer.element.append(this.grid);
    this.viewer.listeners.add(this.drawGrid);
    this.viewer.turn(this.beyond);
  }

  ended() {
    this.grid.remove();
    this.viewer.listeners.delete(this.drawGrid);
    if (this.viewer.page) this.viewer.turn(0);
  }
}

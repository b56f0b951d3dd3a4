// Turning a model by hand: one finger turns, two move and zoom, the wheel zooms, the arrow keys turn.

const VIEW = 32; // degrees of the camera's field, from top to bottom
const FILLED = 0.92; // of the distance at which the sphere around a model just fits: a sheet is no sphere
const MOVED = 0.6; // of that distance, for a finger that goes the height of the picture
const TURN = 0.008; // radians for one px
const KEY_TURN = 0.12; // radians for one key
const [NEAREST, FARTHEST] = [0.2, 4]; // distances, in those that show the whole model
const WHEEL = 0.0012; // of the logarithm of the distance, for one px of the wheel
const STEEPEST = 1.5; // radians up or down: beyond the pole left and right would change places

/** The place of a camera that looks at the middle of a model; `changed` is called when it moves. */
export class Orbit {
  /** @param {HTMLElement} element @param {() => unknown} changed */
  constructor(element, changed) {
    this.element = element;
    this.changed = changed;
    /** @type {Map<number, PointerEvent>} */ this.fingers = new Map();
    this.reset();
    element.addEventListener("pointerdown", (event) => { element.setPointerCapture(event.pointerId); this.fingers.set(event.pointerId, event); });
    for (const name of /** @type {("pointerup" | "pointercancel")[]} */ (["pointerup", "pointercancel"])) element.addEventListener(name, (event) => this.fingers.delete(event.pointerId));
    element.addEventListener("pointermove", (event) => this.drag(event));
    element.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(Math.exp(event.deltaY * WHEEL)); }, { passive: false });
    element.addEventListener("keydown", (event) => this.key(event));
  }

  /**
   * Where the eye is that sees a model of this radius around the origin: its position in mm, the directions right, up and
   * back of it, and the focal length, of the height of the picture.
   * @param {number} radius @param {number} aspect
   */
  eye(radius, aspect) {
    const [sin, cos] = [Math.sin, Math.cos];
    const back = [sin(this.turn) * cos(this.tilt), sin(this.tilt), cos(this.turn) * cos(this.tilt)];
    const right = [cos(this.turn), 0, -sin(this.turn)];
    const up = [-sin(this.turn) * sin(this.tilt), cos(this.tilt), -cos(this.turn) * sin(this.tilt)];
    const whole = (radius / sin((VIEW * Math.PI) / 360) / Math.min(1, aspect)) * FILLED;
    const position = [0, 1, 2].map((k) => whole * (back[k] * this.distance + (right[k] * this.x + up[k] * this.y) * MOVED));
    return { position, right, up, back, focal: 0.5 / Math.tan((VIEW * Math.PI) / 360) };
  }

  reset() {
    this.turn = -0.35;
    this.tilt = 0.45;
    this.distance = 1;
    this.x = 0;
    this.y = 0;
    this.changed();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const steps = /** @type {Record<string, number[]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] })[event.key];
    if (steps) this.rotate(steps[0] * KEY_TURN, steps[1] * KEY_TURN);
    else if (event.key === "+") this.zoom(1 / 1.2);
    else if (event.key === "-") this.zoom(1.2);
    else if (event.key === "0") this.reset();
    else return;
    event.preventDefault();
  }

  /** @param {PointerEvent} event */
  drag(event) {
    const before = this.fingers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    const other = [...this.fingers.values()].find((one) => one.pointerId !== event.pointerId);
    this.fingers.set(event.pointerId, event);
    if (other) {
      const far = (/** @type {PointerEvent} */ one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
      this.move(dx / 2, dy / 2);
      this.zoom(far(before) / far(event));
    } else if (event.buttons & 2 || event.shiftKey) this.move(dx, dy);
    else this.rotate(dx * TURN, dy * TURN);
  }

  /** @param {number} turn @param {number} tilt */
  rotate(turn, tilt) {
    this.turn += turn;
    this.tilt = Math.min(Math.max(this.tilt + tilt, -STEEPEST), STEEPEST);
    this.changed();
  }

  /** @param {number} dx @param {number} dy */
  move(dx, dy) {
    const { clientHeight } = this.element;
    this.x -= (dx / clientHeight) * this.distance;
    this.y += (dy / clientHeight) * this.distance;
    this.changed();
  }

  /** @param {number} factor */
  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, NEAREST), FARTHEST);
    this.changed();
  }
}

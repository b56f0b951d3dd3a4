// Leaves dragged on the contact sheet: by the mouse at once, by a finger after it has rested, as a finger scrolls.

const DRAG_PX = 6; // less is a click
const REST_MS = 400; // of a finger, until it holds a leaf

const under = (/** @type {MouseEvent} */ event) => /** @type {HTMLElement} */ (document.elementFromPoint(event.clientX, event.clientY)?.closest(".leaf") ?? null);

/**
 * Follow a pointer from `down` on. `over` gets the element below it, null for none; `dropped` that on which a leaf is
 * let go. Returns a function that says whether a leaf is held.
 * @param {PointerEvent} down @param {{over: (element: HTMLElement) => void, dropped: (element: HTMLElement) => void}} options
 */
export function follow(down, { over, dropped }) {
  const [end, isTouch] = [new AbortController(), down.pointerType === "touch"];
  const options = { signal: end.signal };
  const far = (/** @type {MouseEvent} */ event) => Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) > DRAG_PX;
  let held = false;
  const rest = isTouch ? setTimeout(() => { held = true; over(under(down)); }, REST_MS) : 0;
  const stop = () => { clearTimeout(rest); end.abort(); over(null); };
  addEventListener("pointermove", (event) => {
    if (!held && far(event)) {
      if (isTouch) return stop(); // it scrolls
      held = true;
    }
    return held ? over(under(event)) : undefined;
  }, options);
  addEventListener("touchmove", (event) => { if (held) event.preventDefault(); }, { ...options, passive: false });
  addEventListener("contextmenu", (event) => { if (isTouch) event.preventDefault(); }, options);
  addEventListener("pointercancel", stop, options);
  addEventListener("pointerup", (event) => {
    const target = held ? under(event) : null;
    stop();
    if (target) dropped(target);
  }, options);
  return () => held;
}

// The aids of focus and exposure: the preview, what lies out of the depth window over it, histogram and clipping.

import { keyed } from "../api.js";
import { button, h, icon, placeholder, set } from "../dom.js";
import { measure, number, percent, time } from "../format.js";
import { levelIcon } from "./strip.js";
import { actionButton } from "../actions.js";
import { t } from "../strings.js";

const [WIDE, HIGH] = [256, 72]; // of the histogram, in its own units
const QUANTILE = 0.995; // of the bins: a few that stand out do not flatten the others

/** The outline of 256 counts as an SVG path; `top` is the count that reaches the upper edge. @param {number[]} counts @param {number} top */
export function outline(counts, top) {
  const points = counts.map((count, at) => `${at},${(HIGH * (1 - Math.min(count / top, 1))).toFixed(1)}`);
  return `M0,${HIGH} L${points.join(" L")} L${WIDE - 1},${HIGH} Z`;
}

/** @param {Preview} preview */
function histogram({ histogram: bins, clipped }) {
  const counts = [...bins.r, ...bins.g, ...bins.b].sort((one, two) => one - two);
  const top = Math.max(counts[Math.floor(counts.length * QUANTILE)], 1);
  const channel = (/** @type {keyof Channels} */ name) => h("path", { class: `channel ${name}`, d: outline(bins[name], top) });
  return h("figure", { class: "aid histogram" },
    h("figcaption", { text: t("histogram") }),
    h("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, preserveAspectRatio: "none", role: "img", "aria-label": t("histogram.label") },
      channel("grey"), channel("r"), channel("g"), channel("b")),
    h("p", { class: "ends" }, h("span", { text: `${t("clipped.black")} ${percent(clipped.black)}` }),
      h("span", { text: `${t("clipped.white")} ${percent(clipped.white)}` })));
}

/** @param {Preview} preview */
function depthGauge({ depth, distance_mm: distance }) {
  if (!depth) return null;
  const [low, high] = [Math.min(depth.near, depth.min), Math.max(depth.far, depth.max)];
  const at = (/** @type {number} */ value) => ((value - low) / (high - low || 1)) * 100;
  const bar = (/** @type {string} */ class_, /** @type {number} */ from, /** @type {number} */ to) => h("rect", { class: class_, x: at(from), width: Math.max(at(to) - at(from), 1), y: class_ === "window" ? 6 : 3, height: class_ === "window" ? 8 : 14, rx: 2 });
  const inside = depth.inside_fraction >= 0.999;
  return h("figure", { class: "aid depth" },
    h("figcaption", { text: t("depth") }),
    h("svg", { viewBox: "0 0 100 20", preserveAspectRatio: "none", "aria-hidden": "true" },
      bar("window", depth.near, depth.far), bar(inside ? "reach" : "reach out", depth.min, depth.max)),
    h("p", { class: "ends" }, h("span", { text: `${number(depth.near)} ${depth.unit}` }),
      distance ? h("span", { text: t("depth.at", { mm: number(distance) }) }) : null, h("span", { text: `${number(depth.far)} ${depth.unit}` })),
    h("p", { text: t("depth.page", { min: number(depth.min), max: number(depth.max), share: percent(depth.inside_fraction) }) }));
}

/** @param {Preview} preview */
function sharpness({ sharpness: found }) {
  if (!found || found.blur_px === null) return null;
  return h("p", { class: "aid focus", "data-level": found.level }, icon(levelIcon(found.level)),
    h("span", { text: `${t("measure.blur_px")} ${measure(found.blur_px, "px")}` }));
}

/** @param {Preview} preview */
function legend(preview) {
  return h("ul", { class: "legend" }, preview.legend.filter((entry) => entry.fraction > 0).map((entry) => {
    const swatch = h("rect", { width: 12, height: 12, rx: 2 });
    swatch.style.fill = entry.colour;
    return h("li", {}, h("svg", { viewBox: "0 0 12 12", class: "swatch", "aria-hidden": "true" }, swatch),
      h("span", { text: `${t(`legend.${entry.key}`)} ${percent(entry.fraction)}` }));
  }));
}

/** The preview's place on the screen; `show` takes what the server has, null when there is none yet. */
export function previewPane() {
  const element = h("div", { class: "preview" });
  let aids = true;
  /** @type {Preview} */ let shown;
  const show = (/** @type {Preview} */ preview) => {
    shown = preview;
    if (!preview) {
      element.replaceChildren(placeholder("preview", t("preview.none"), t("preview.none.text"), actionButton("preview")));
      return;
    }
    const overlay = h("img", { class: "overlay", src: keyed(preview.overlay), alt: "", hidden: !aids });
    const toggle = button(t("preview.aids"), { icon: "focus", click: () => { aids = !aids; show(shown); } });
    set(toggle, "aria-pressed", String(aids));
    element.replaceChildren(
      h("figure", { class: "preview-picture" },
        h("img", { src: keyed(preview.image), width: preview.width, height: preview.height, alt: t("preview.alt", { time: time(preview.time) }) }), overlay),
      h("div", { class: "aids" }, histogram(preview), depthGauge(preview),
        h("div", { class: "aid-side" }, sharpness(preview), legend(preview), h("div", { class: "row" }, toggle, actionButton("preview")))));
  };
  show(null);
  return { element, show };
}

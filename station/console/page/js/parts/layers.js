// Which layers lie on each other, and what their colours mean.

import { getOrNull } from "../api.js";
import { h, segmented, set } from "../dom.js";
import { measure, percent } from "../format.js";
import { t } from "../strings.js";

const VEIL = 0.85; // opacity of an overlay: the print stays readable

/** @param {string[]} stops */
function ramp(stops) {
  const width = 100 / stops.length;
  return h("svg", { class: "ramp", viewBox: "0 0 100 8", preserveAspectRatio: "none", "aria-hidden": "true" },
    stops.map((colour, at) => {
      const rect = h("rect", { x: at * width, width: width + 0.2, height: 8 });
      rect.style.fill = colour;
      return rect;
    }));
}

/** @param {Answers["strain"]} scale */
function strainScale(scale) {
  const { min, max, rms } = scale.stretch;
  return h("div", {}, ramp(scale.colours),
    h("p", { class: "ends" }, h("span", { text: `−${percent(scale.end)}` }), h("span", { text: t("strain.none") }), h("span", { text: `+${percent(scale.end)}` })),
    h("p", { class: "soft", text: t("strain.summary", { min: percent(min), max: percent(max), rms: percent(rms) }) }));
}

/** Micrometres: a good page is off by some hundredths of a millimetre. */
const micrometres = (/** @type {number} */ mm) => measure(mm * 1000, "µm");

/** @param {Answers["uncertainty"]} scale */
function uncertaintyScale(scale) {
  const { total, noise, p95 } = scale.uncertainty_mm;
  return h("div", {}, ramp(scale.colours),
    h("p", { class: "ends" }, h("span", { text: "0" }), h("span", { text: micrometres(scale.end) })),
    h("p", { class: "soft", text: t("uncertainty.summary", { total: micrometres(total), noise: micrometres(noise), p95: micrometres(p95) }) }));
}

/** @param {Answers["coverage"]} scale */
function coverageLegend(scale) {
  return h("ul", { class: "legend" }, scale.kinds.map(({ key, colour, fraction }) => {
    const swatch = h("rect", { width: 12, height: 12, rx: 2, class: colour ? "" : "no-colour" });
    if (colour) swatch.style.fill = colour;
    return h("li", {}, h("svg", { viewBox: "0 0 12 12", class: "swatch", "aria-hidden": "true" }, swatch),
      h("span", { text: `${t(`coverage.${key}`)} ${percent(fraction)}` }));
  }));
}

/** Overlays, from the lowest on: where what their colours mean is found, and how it is shown. */
const LEGENDS = /** @type {Record<string, {path: string, shown: (found: any) => HTMLElement}>} */ ({
  strain: { path: "strain/scale", shown: strainScale }, coverage: { path: "coverage/legend", shown: coverageLegend },
  uncertainty: { path: "uncertainty/scale", shown: uncertaintyScale } });
const OVERLAYS = Object.keys(LEGENDS);

/** The choice of layers: `changed` is called when another is chosen. @param {() => unknown} changed */
export function layerChoice(changed) {
  /** @type {Set<string>} */ const above = new Set();
  let lowest = "page";
  const legends = h("div", { class: "legends" });
  const base = segmented(t("layers.light"), [["page", t("layer.page")], ["master", t("layer.master")]],
    (key) => { lowest = key; changed(); });
  const boxes = OVERLAYS.map((name) => {
    const input = h("input", { type: "checkbox", id: `layer-${name}`, on: { change: () => { above[input.checked ? "add" : "delete"](name); changed(); } } });
    return { name, input, label: h("label", { class: "check", for: input.id }, input, h("span", { text: t(`layer.${name}`) })) };
  });
  const element = h("section", { class: "tool-panel", "aria-label": t("layers") }, h("h2", { text: t("layers") }),
    h("div", { class: "layer-row" }, base.element, boxes.map(({ label }) => label)), legends);
  const explain = async (/** @type {Row} */ row, /** @type {string} */ prefix, /** @type {string[]} */ names) => {
    const parts = await Promise.all(names.map(async (/** @type {string} */ name) => {
      const { path, shown } = LEGENDS[name];
      const found = await getOrNull(`/api/pictures/${row.restore}/${path}?leaf=${prefix}`);
      return found ? [shown(found)] : [];
    }));
    legends.replaceChildren(...parts.flat());
  };
  return { element,
    /** The layers for the viewer, of those that the page or leaf has. @param {Row} row @param {PageLeaf} leaf */
    of(row, { layers: offered, prefix }) {
      base.offer(["page", "master"].filter((name) => offered.includes(name)));
      const bottom = offered.includes(lowest) ? lowest : "page";
      base.show(bottom);
      base.element.hidden = !offered.includes("master");
      for (const { name, input, label } of boxes) {
        label.hidden = !offered.includes(name);
        set(input, "disabled", !offered.includes(name));
      }
      const names = OVERLAYS.filter((name) => above.has(name) && offered.includes(name));
      explain(row, prefix, names);
      return [bottom, ...names].map((layer, at) => ({ event: row.restore, layer: `${prefix}${layer}`, opacity: at ? VEIL : 1 }));
    } };
}

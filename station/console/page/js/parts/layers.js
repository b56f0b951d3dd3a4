// Which layers lie on each other, and what their colours mean.

import { get } from "../api.js";
import { h, segmented, set } from "../dom.js";
import { measure, percent } from "../format.js";
import { t } from "../strings.js";

const VEIL = 0.85; // opacity of an overlay: the print stays readable

function ramp(stops) {
  const width = 100 / stops.length;
  return h("svg", { class: "ramp", viewBox: "0 0 100 8", preserveAspectRatio: "none", "aria-hidden": "true" },
    stops.map((colour, at) => {
      const rect = h("rect", { x: at * width, width: width + 0.2, height: 8 });
      rect.style.fill = colour;
      return rect;
    }));
}

function strainScale(told) {
  const { min, max, rms } = told.stretch;
  return h("div", {}, ramp(told.colours),
    h("p", { class: "ends" }, h("span", { text: `−${percent(told.end)}` }), h("span", { text: t("strain.none") }), h("span", { text: `+${percent(told.end)}` })),
    h("p", { class: "soft", text: t("strain.told", { min: percent(min), max: percent(max), rms: percent(rms) }) }));
}

/** Micrometres: a good page is off by some hundredths of a millimetre. */
const micrometres = (mm) => measure(mm * 1000, "µm");

function uncertaintyScale(told) {
  const { total, noise, p95 } = told.uncertainty_mm;
  return h("div", {}, ramp(told.colours),
    h("p", { class: "ends" }, h("span", { text: "0" }), h("span", { text: micrometres(told.end) })),
    h("p", { class: "soft", text: t("uncertainty.told", { total: micrometres(total), noise: micrometres(noise), p95: micrometres(p95) }) }));
}

function coverageLegend(told) {
  return h("ul", { class: "legend" }, told.kinds.map(({ key, colour, fraction }) => {
    const swatch = h("rect", { width: 12, height: 12, rx: 2, class: colour ? "" : "no-colour" });
    if (colour) swatch.style.fill = colour;
    return h("li", {}, h("svg", { viewBox: "0 0 12 12", class: "swatch", "aria-hidden": "true" }, swatch),
      h("span", { text: `${t(`coverage.${key}`)} ${percent(fraction)}` }));
  }));
}

/** Overlays, from the lowest on: where what their colours mean is found, and how it is shown. */
const LEGENDS = { strain: ["strain/scale", strainScale], coverage: ["coverage/legend", coverageLegend], uncertainty: ["uncertainty/scale", uncertaintyScale] };
const OVERLAYS = Object.keys(LEGENDS);

/** The choice of layers: `changed` is called when another is chosen. */
export function layerChoice(changed) {
  const chosen = { base: "page" };
  const legends = h("div", { class: "legends" });
  const base = segmented(t("layers.light"), [["page", t("layer.page")], ["master", t("layer.master")]],
    (key) => { chosen.base = key; changed(); });
  const boxes = OVERLAYS.map((name) => {
    const input = h("input", { type: "checkbox", id: `layer-${name}`, on: { change: () => { chosen[name] = input.checked; changed(); } } });
    return [name, input, h("label", { class: "check", for: input.id }, input, h("span", { text: t(`layer.${name}`) }))];
  });
  const element = h("section", { class: "tool-panel", "aria-label": t("layers") }, h("h2", { text: t("layers") }),
    h("div", { class: "layer-row" }, base.element, boxes.map(([, , label]) => label)), legends);
  const explain = async (row, prefix, above) => {
    const parts = await Promise.all(above.map((name) => {
      const [path, shown] = LEGENDS[name];
      return get(`/api/pictures/${row.restore}/${path}?leaf=${prefix}`).then(shown).catch(() => null);
    }));
    legends.replaceChildren(...parts.filter(Boolean));
  };
  return { element,
    /** The layers for the viewer, of those that the page or leaf has. */
    of(row, { layers: offered, prefix }) {
      base.offer(["page", "master"].filter((name) => offered.includes(name)));
      const lowest = offered.includes(chosen.base) ? chosen.base : "page";
      base.show(lowest);
      base.element.hidden = !offered.includes("master");
      for (const [name, input, label] of boxes) {
        label.hidden = !offered.includes(name);
        set(input, "disabled", !offered.includes(name));
      }
      const above = OVERLAYS.filter((name) => chosen[name] && offered.includes(name));
      explain(row, prefix, above);
      return [lowest, ...above].map((layer, at) => ({ event: row.restore, layer: `${prefix}${layer}`, opacity: at ? VEIL : 1 }));
    } };
}

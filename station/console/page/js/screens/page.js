// The page view: the flat page to its pixels, its layers, ruler and words; the sheet in space; its lights and history.

import { actionPad } from "../actions.js";
import { button, h, placeholder, segmented, set, setText } from "../dom.js";
import { faultText } from "../faults.js";
import { bytes, number, pageName, time } from "../format.js";
import { setToolKey } from "../keys.js";
import { Compare } from "../parts/compare.js";
import { details } from "../parts/details.js";
import { layerChoice } from "../parts/layers.js";
import { LayoutTool } from "../parts/layout.js";
import { leafChoice } from "../parts/leaves.js";
import { ModelView } from "../parts/model_view.js";
import { Ruler } from "../parts/ruler.js";
import { pageStrip } from "../parts/strip.js";
import { levelSign, verdictLights } from "../parts/verdict.js";
import { PageViewer } from "../parts/viewer.js";
import { Words } from "../parts/words.js";
import { current, on, select, store } from "../store.js";
import { firstOf, t } from "../strings.js";
import { facts } from "./capture.js";

const TOOLS = [["look", "hand"], ["compare", "columns-2"], ["ruler", "ruler"], ["words", "text-search"], ["model", "rotate-3d"], ["spine", "between-vertical-start"]];

class PageScreen {
  constructor() {
    this.viewer = new PageViewer();
    this.compare = new Compare(this.viewer);
    this.ruler = new Ruler(this.viewer);
    this.words = new Words(this.viewer, (page) => { select(page); return this.update(); });
    this.model = new ModelView();
    this.layout = new LayoutTool();
    this.layers = layerChoice(() => this.showLayers());
    this.leaves = leafChoice(() => this.update());
    this.lights = verdictLights();
    this.tool = "look";
    this.against = "original";
    this.tools = segmented(t("tools"), TOOLS.map(([name, picture]) => [name, t(`tool.${name}`), picture]), (tool) => this.use(tool));
    this.comparing = segmented(t("compare.with"), [["original", t("layer.original")], ["master", t("layer.master")]],
      (layer) => { this.against = layer; this.use("compare"); });
    this.zooms = h("div", { class: "zooms" }, [["zoom-out", "zoom.out", () => this.viewer.zoom(1 / 1.5)], ["zoom-in", "zoom.in", () => this.viewer.zoom(1.5)],
      ["maximize", "zoom.fit", () => this.viewer.fit()], ["scan-eye", "zoom.pixels", () => this.viewer.pixels()]].map(([picture, name, click]) =>
      button("", { icon: picture, kind: "square", label: t(name), click })));
    this.title = h("h1", { class: "page-title" });
    this.sub = h("p", { class: "soft page-sub" });
    this.sign = h("div", { class: "sign-place" });
    this.more = h("div", { class: "more" });
    this.empty = h("div", { class: "viewer-empty" });
    this.compareBox = h("section", { class: "tool-panel", "aria-label": t("tool.compare") }, h("h2", { text: t("compare.with") }), this.comparing.element);
    this.element = h("div", { class: "screen page-screen" },
      h("section", { class: "viewer", "aria-label": t("picture") }, h("div", { class: "viewer-head" }, this.tools.element, this.leaves.element, this.zooms),
        this.viewer.element, this.model.element, this.empty),
      h("section", { class: "panel scrolling", "aria-label": t("page"), tabindex: "0" },
        h("div", { class: "panel-head" }, h("div", {}, this.title, this.sub), this.sign),
        this.compareBox, this.ruler.element, this.words.element, this.layout.element, this.layers.element, this.lights.element,
        actionPad(["accept", "again", "mark", "note", "insert", "label"]), this.more),
      pageStrip());
    for (const event of ["rows", "row", "selected"]) on(event, () => { if (this.element.isConnected) this.update(); });
  }

  enter(argument) {
    const page = Number(argument);
    if (store.rows.has(page)) select(page);
    setToolKey((key) => this.key(key));
    return this.update();
  }

  leave() {
    setToolKey(null);
    this.model.leave();
  }

  async update() {
    const row = current();
    setText(this.title, row ? pageName(row) : t("capture.none"));
    setText(this.sub, row ? facts(row) : "");
    this.sign.replaceChildren(row ? levelSign(row) : "");
    if (this.row?.page !== row?.page) this.lights.show(null, null); // those of the page before would be taken for its own
    const found = row ? await details(row) : null;
    if (current()?.page !== row?.page) return;
    this.row = row;
    this.details = found;
    this.leaf = this.leaves.of(found);
    this.lights.show(row, found?.checks, found?.notes);
    this.more.replaceChildren(...(found ? [...history(found, this.leaf)] : []));
    await this.use(this.tool);
  }

  key(key) {
    if (key === "s") this.use(this.tool === "spine" ? "look" : "spine");
    else return this.tool === "spine" && Boolean(this.row) && this.layout.key(key);
    return true;
  }

  get flat() {
    return Boolean(this.row?.restore && !this.row.failed && this.leaf?.layers.includes("page"));
  }

  async use(tool) {
    this.tool = tool;
    this.tools.show(tool);
    this.end();
    const drawn = this.flat;
    for (const [name, panel] of [["compare", this.compareBox], ["ruler", this.ruler.element], ["words", this.words.element]]) panel.hidden = !drawn || tool !== name;
    this.layout.element.hidden = !this.row || tool !== "spine";
    if (this.row && tool === "spine") this.layout.start(this.row);
    this.layers.element.hidden = !drawn || tool === "model";
    this.viewer.element.hidden = !drawn || tool === "model";
    this.model.element.hidden = !drawn || tool !== "model";
    this.zooms.hidden = !drawn || tool === "model";
    this.empty.hidden = drawn;
    if (!drawn) return this.showEmpty();
    if (tool === "model") return this.model.show(this.row);
    this.model.leave();
    await this.showLayers();
    if (tool === "compare") {
      this.comparing.offer(["original", "master"].filter((name) => name === "original" || this.leaf.layers.includes(name)));
      this.comparing.show(this.against);
      await this.compare.show(this.row, this.viewer.page, this.against, this.leaf.prefix);
    } else if (tool === "ruler") this.ruler.start(this.row);
    else if (tool === "words") await this.words.start(this.row);
    return undefined;
  }

  end() {
    this.compare.end();
    this.ruler.end();
    this.words.end();
  }

  showEmpty() {
    const [row, failed] = [this.row, this.row?.failed ?? this.leaf?.failed];
    const [picture, name] = !row ? ["first-page", "page.none"] : failed ? ["failed", "page.failed"] : ["working", "page.waiting"];
    this.empty.replaceChildren(placeholder(picture, t(name), failed ? faultText(failed, "page.failed.text") : t(`${name}.text`)));
  }

  showLayers() {
    if (!this.flat) return undefined;
    const { page_px: [width, height], dpi, prefix } = this.leaf;
    const page = { key: `${this.row.page} ${prefix}`, width, height, dpi };
    return this.viewer.show(page, this.layers.of(this.row, this.leaf));
  }
}

function* history(found, leaf) {
  const [width, height] = leaf?.page_mm ?? [];
  const figures = [["fact.size", width && `${number(width, 1)} × ${number(height, 1)} mm`], ["fact.dpi", leaf?.dpi && `${number(leaf.dpi)} dpi`],
    ["fact.shots", found.shots.length]].filter(([, value]) => value);
  yield h("dl", { class: "figures" }, figures.map(([name, value]) => h("div", {}, h("dt", { text: t(name) }), h("dd", { text: value }))));
  yield h("details", {}, h("summary", { text: t("history") }), h("ol", { class: "events" }, found.events.map((event) =>
    h("li", {}, h("time", { text: time(event.time) }), h("span", { text: [firstOf([`step.${event.name}`], event.name), typeof event.value === "string" ? event.value : ""].filter(Boolean).join(": ") })))));
  yield h("details", {}, h("summary", { text: t("files") }), h("ul", { class: "events" }, found.files.map((file) =>
    h("li", {}, h("span", { text: file.name }), h("span", { class: "soft", text: bytes(file.bytes) })))));
}

/** The screen, made once. */
export default function pageScreen() {
  const screen = new PageScreen();
  set(screen.element, "data-screen", "page");
  return screen;
}

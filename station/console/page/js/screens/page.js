// The page view: the flat page to its pixels, its layers, ruler and words; the sheet in space; its lights and history.

import { actionPad } from "../actions.js";
import { valueAt } from "../corrections.js";
import { able, button, h, placeholder, segmented, set, setText } from "../dom.js";
import { Draft } from "../draft.js";
import { faultText } from "../faults.js";
import { bytes, number, pageName, time } from "../format.js";
import { setToolKey } from "../keys.js";
import { openApply } from "../parts/apply.js";
import { askList, nextAsking } from "../parts/asks.js";
import { MaskTool, OutlineTool } from "../parts/areas.js";
import { Compare } from "../parts/compare.js";
import { CropTool } from "../parts/crop.js";
import { details } from "../parts/details.js";
import { draftPanel } from "../parts/draft_panel.js";
import { layerChoice } from "../parts/layers.js";
import { LayoutTool } from "../parts/layout.js";
import { leafChoice } from "../parts/leaves.js";
import { LightTool } from "../parts/light.js";
import { ModelView } from "../parts/model_view.js";
import { Ruler } from "../parts/ruler.js";
import { pageStrip } from "../parts/strip.js";
import { TurnTool } from "../parts/turn.js";
import { levelSign, verdictLights } from "../parts/verdict.js";
import { PageViewer } from "../parts/viewer.js";
import { Words } from "../parts/words.js";
import { current, on, select, store } from "../store.js";
import { firstOf, t } from "../strings.js";
import { facts } from "./capture.js";

const TOOLS = [["look", "hand"], ["compare", "columns-2"], ["ruler", "ruler"], ["words", "text-search"], ["model", "rotate-3d"],
  ["spine", "between-vertical-start"], ["outline", "scan-line"], ["mask", "focus"], ["crop", "maximize"], ["turn", "refresh-cw"], ["light", "sun"]];
/** @type {Record<string, number>} */ const ASK_KEYS = { j: 1, k: -1 };
/** @type {Record<string, string>} */ const TOOL_KEYS = { s: "spine", o: "outline", x: "mask", c: "crop", t: "turn", l: "light" };

class PageScreen {
  constructor() {
    this.viewer = new PageViewer();
    this.compare = new Compare(this.viewer);
    this.ruler = new Ruler(this.viewer);
    this.words = new Words(this.viewer, (page, part) => { this.leaves.choose(part); select(page); return this.update(); });
    this.model = new ModelView();
    this.draft = new Draft(() => this.showDraft());
    /** @type {Record<string, import("../parts/tool.js").CorrectionTool>} */
    this.hands = { spine: new LayoutTool(this.draft, this.viewer), outline: new OutlineTool(this.draft, this.viewer),
      mask: new MaskTool(this.draft, this.viewer), crop: new CropTool(this.draft, this.viewer), turn: new TurnTool(this.draft, this.viewer), light: new LightTool(this.draft) };
    for (const hand of Object.values(this.hands)) hand.apply = () => this.apply();
    this.drafted = draftPanel(this.draft);
    this.asks = askList((step) => this.goAsking(step));
    this.layers = layerChoice(() => this.showLayers());
    this.leaves = leafChoice(() => { this.asked = null; this.update(); });
    this.lights = verdictLights();
    this.tool = "look";
    this.against = "original";
    this.tools = segmented(t("tools"), TOOLS.map(([name, picture]) => [name, t(`tool.${name}`), picture]), (tool) => this.use(tool));
    this.comparing = segmented(t("compare.with"), [["original", t("layer.original")], ["master", t("layer.master")]],
      (layer) => { this.against = layer; this.use("compare"); });
    this.zooms = h("div", { class: "zooms" }, /** @type {[string, string, () => void][]} */ ([["zoom-out", "zoom.out", () => this.viewer.zoom(1 / 1.5)], ["zoom-in", "zoom.in", () => this.viewer.zoom(1.5)],
      ["maximize", "zoom.fit", () => this.viewer.fit()], ["scan-eye", "zoom.pixels", () => this.viewer.pixels()]]).map(([picture, name, click]) =>
      button("", { icon: picture, kind: "square", label: t(name), click })));
    this.title = h("h1", { class: "page-title" });
    this.sub = h("p", { class: "soft page-sub" });
    this.sign = h("div", { class: "sign-place" });
    this.more = h("div", { class: "more" });
    this.empty = h("div", { class: "viewer-empty" });
    this.earlier = button(t("before"), { icon: "history", key: "v", kind: "before-button", click: () => this.showEarlier(!this.isEarlier) });
    this.compareBox = h("section", { class: "tool-panel", "aria-label": t("tool.compare") }, h("h2", { text: t("compare.with") }), this.comparing.element);
    this.element = h("div", { class: "screen page-screen" },
      h("section", { class: "viewer", "aria-label": t("picture") }, h("div", { class: "viewer-head" }, this.tools.element, this.leaves.element, this.earlier, this.zooms),
        this.viewer.element, this.model.element, this.empty),
      h("section", { class: "panel scrolling", "aria-label": t("page"), tabindex: "0" },
        h("div", { class: "panel-head" }, h("div", {}, this.title, this.sub), this.sign),
        this.asks.element, this.drafted.element, this.compareBox, this.ruler.element, this.words.element,
        Object.values(this.hands).map((hand) => hand.element), this.layers.element, this.lights.element,
        actionPad(["accept", "again", "mark", "note", "insert", "label"]), this.more),
      pageStrip());
    for (const event of /** @type {(keyof StoreEvents)[]} */ (["rows", "row", "selected"])) on(event, () => { if (this.element.isConnected) this.update(); });
  }

  /** @param {string} argument */
  enter(argument) {
    const page = Number(argument);
    if (store.rows.has(page)) select(page);
    setToolKey((key, event) => this.key(key, event));
    return this.update();
  }

  leave() {
    setToolKey(null);
    this.model.leave();
  }

  async update() {
    const row = current();
    this.asks.show();
    setText(this.title, row ? pageName(row) : t("capture.none"));
    setText(this.sub, row ? facts(row) : "");
    this.sign.replaceChildren(row ? levelSign(row) : "");
    if (this.row?.page !== row?.page) this.lights.show(null, null); // those of the page before would be taken for its own
    const found = row ? await details(row) : null;
    if (current()?.page !== row?.page) return;
    if (this.row?.restore !== row?.restore) this.isEarlier = false;
    this.row = row;
    this.details = found;
    this.leaf = this.leaves.of(found);
    for (const hand of Object.values(this.hands)) hand.part = this.leaf?.part ?? "page";
    if (row) this.draft.load(row);
    this.lights.show(row, found?.checks, found?.notes);
    this.more.replaceChildren(...(found ? [...history(found, this.leaf)] : []));
    await this.use(this.tool);
  }

  /** @param {string} key @param {KeyboardEvent} event */
  key(key, event) {
    const name = TOOL_KEYS[key];
    if (name) this.use(this.tool === name ? "look" : name);
    else if (key === "a") this.apply();
    else if (ASK_KEYS[key]) this.goAsking(ASK_KEYS[key]);
    else if (key === "v") this.showEarlier(!this.isEarlier);
    else if (key === "Enter" && this.draft.isOpen) this.draft.save();
    else if (key === "Escape" && this.draft.isOpen) this.draft.drop();
    else return Boolean(this.row) && Boolean(this.hands[this.tool]?.key(key, event));
    return true;
  }

  /** Go to the leaf that asks for a correction next, or before. @param {number} step */
  goAsking(step) {
    const page = current()?.page;
    const found = nextAsking(step, page, this.asked?.page === page ? this.asked.part : this.leaf?.part);
    if (!found) return;
    this.asked = found; // a further key may come before its details
    this.leaves.choose(found.part);
    select(found.page);
  }

  /** Put fields of this page on others; those that a rule gives it now are not left in the draft. */
  apply() {
    const [{ row, draft, leaf }, chosen] = [this, this.hands[this.tool]];
    if (!row || !draft.base) return;
    const offered = Object.values(this.hands).flatMap((hand) => hand.own.map((one) => ({ ...one, isChosen: !chosen || chosen === hand })));
    if (!offered.length) {
      draft.say(t("apply.nothing"));
      return;
    }
    openApply(row, leaf?.part ?? "page", offered, (made, edits) => {
      const isOn = made.pages.includes(row.page) && !made.own[row.page] && this.row.page === row.page;
      const given = Object.keys(draft.fields).filter((path) => isOn && valueAt(edits, path) !== undefined);
      draft.set(Object.fromEntries(given.map((path) => [path, /** @type {unknown} */ (undefined)])));
      draft.say(t("apply.done", { n: number(made.pages.length) }));
      draft.load(this.row);
    });
  }

  showDraft() {
    this.drafted.show();
    if (this.row && this.wasOnScan !== this.isOnScan) this.use(this.tool);
    else this.hands[this.tool]?.show();
    this.showBefore();
  }

  /** Show the page as it was before: without the draft of its tool, and as it was restored before. @param {boolean} on */
  async showEarlier(on) {
    if (!this.flat || this.earlier.hasAttribute("aria-disabled")) return;
    this.isEarlier = on;
    await this.use(this.tool);
  }

  showBefore() {
    const possible = Boolean(this.details?.before) || (this.tool === "turn" && this.draft.isOpen);
    able(this.earlier, possible ? "" : t("before.none"));
    set(this.earlier, "aria-pressed", String(Boolean(this.isEarlier)));
  }

  get flat() {
    return Boolean(this.row?.restore && !this.row.failed && this.leaf?.layers.includes("page"));
  }

  /** Whether the tool works on the scanner's picture. */
  get isOnScan() {
    return Boolean(this.row && this.hands[this.tool]?.isOnScan) && !this.isEarlier;
  }

  /** @param {string} tool */
  async use(tool) {
    this.tool = tool;
    this.wasOnScan = this.isOnScan;
    this.tools.show(tool);
    this.end();
    const drawn = this.flat || this.isOnScan;
    for (const [name, panel] of Object.entries({ compare: this.compareBox, ruler: this.ruler.element, words: this.words.element })) panel.hidden = !drawn || tool !== name;
    for (const [name, hand] of Object.entries(this.hands)) hand.element.hidden = !this.row || tool !== name;
    this.layers.element.hidden = !this.flat || this.isOnScan || tool === "model";
    this.viewer.element.hidden = !drawn || tool === "model";
    this.model.element.hidden = !drawn || tool !== "model";
    this.zooms.hidden = !drawn || tool === "model";
    this.empty.hidden = drawn;
    this.earlier.hidden = !this.flat || tool === "model";
    this.showBefore();
    if (!drawn || tool === "model") this.startHand();
    if (!drawn) return this.showEmpty();
    if (tool === "model") return this.model.show(this.row, this.leaf);
    this.model.leave();
    await this.showLayers();
    if (this.tool !== tool) return undefined; // another one was chosen meanwhile
    this.startHand();
    if (tool === "compare") {
      this.comparing.offer(["original", "master"].filter((name) => name === "original" || this.leaf.layers.includes(name)));
      this.comparing.show(this.against);
      await this.compare.show(this.row, this.viewer.page, this.against, this.leaf.prefix);
    } else if (tool === "ruler") this.ruler.start(this.row, this.leaf);
    else if (tool === "words") await this.words.start(this.row, this.leaf);
    return undefined;
  }

  startHand() {
    const hand = this.row && this.hands[this.tool];
    if (hand) hand.isStill = this.isEarlier;
    hand?.start(this.row, this.leaf?.part ?? "page");
  }

  end() {
    for (const [name, hand] of Object.entries(this.hands)) if (name !== this.tool) hand.end();
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
    if (this.isOnScan) {
      return this.viewer.show({ key: `${this.row.capture} original`, isScan: true }, [{ event: this.row.capture, layer: "original" }]);
    }
    if (!this.flat) return undefined;
    const [event, leaf] = this.pictured();
    const { page_px: [width, height], dpi, prefix } = leaf;
    const page = { key: `${this.row.page} ${prefix} ${width} ${height}`, width, height, dpi };
    return this.viewer.show(page, this.layers.of({ ...this.row, restore: event }, leaf));
  }

  /** The restoration that is shown, and its leaf: the present one, or the one before it. @returns {[number, PageLeaf]} */
  pictured() {
    const { before } = this.details;
    const leaf = this.isEarlier && before?.leaves.find(({ page_px: size, part }) => size && (part === this.leaf.part || before.leaves.length === 1));
    return leaf ? [before.event, leaf] : [this.row.restore, this.leaf];
  }
}

/** @param {Details} found @param {PageLeaf} leaf */
function* history(found, leaf) {
  const [width, height] = leaf?.page_mm ?? [];
  const figures = [["fact.size", width && `${number(width, 1)} × ${number(height, 1)} mm`], ["fact.dpi", leaf?.dpi && `${number(leaf.dpi)} dpi`],
    ["fact.shots", String(found.shots.length)]].filter(([, value]) => value);
  yield h("dl", { class: "figures" }, figures.map(([name, value]) => h("div", {}, h("dt", { text: t(name) }), h("dd", { text: value }))));
  yield h("details", {}, h("summary", { text: t("history") }), h("ol", { class: "events" }, found.events.map((event) =>
    h("li", {}, h("time", { text: time(event.time) }), h("span", { text: [event.name === "accept" && event.value === false ? t("state.again") : firstOf([`step.${event.name}`], event.name), typeof event.value === "string" ? event.value : ""].filter(Boolean).join(": ") })))));
  yield h("details", {}, h("summary", { text: t("files") }), h("ul", { class: "events" }, found.files.map((file) =>
    h("li", {}, h("span", { text: file.name }), h("span", { class: "soft", text: bytes(file.bytes) })))));
}

/** The screen, made once. */
export default function pageScreen() {
  const screen = new PageScreen();
  set(screen.element, "data-screen", "page");
  return screen;
}

// The contact sheet: all leaves of the volume, as openings or singles; their order, their labels, and what is left out.

import { actions, reason } from "../actions.js";
import { getOrNull, keyed, post, put } from "../api.js";
import { button, h, icon, placeholder, segmented, set, setIcon, setText } from "../dom.js";
import { number } from "../format.js";
import { openMissing, openRun, runText } from "../parts/arranging.js";
import { follow } from "../parts/sheet_drag.js";
import { levelIcon } from "../parts/strip.js";
import { ordersApart, sendVersion, setLabel } from "../parts/versions.js";
import { on, select, store } from "../store.js";
import { t } from "../strings.js";

/** @type {Record<string, number>} */ const SIZES = { small: 96, medium: 148, large: 256 }; // px, width of a cell
const FOOT = 60; // px by which a cell is higher than wide, as the style sheet has it
const [PADDING, GAP] = [8, 16]; // px around the sheet; between two openings
const SPARE = 2; // lines above and below those in sight

/** What lies at each place: leaves, and the labels of missing ones before them. @param {SheetLeaf[]} leaves */
export function singles(leaves) {
  return leaves.flatMap((leaf) => [...leaf.missing, leaf]);
}

/** @typedef {SheetLeaf | string | object} Slot */
const BREAK = {}; // a place that is empty because two leaves of one side follow each other

/** The same as openings: left leaves on even places, right ones on odd; null: nothing lies there. @param {SheetLeaf[]} leaves */
export function openings(leaves) {
  /** @type {Slot[]} */ const slots = [];
  const isOneSide = (/** @type {SheetLeaf} */ leaf) => leaf?.side === "left" || leaf?.side === "right";
  leaves.forEach((leaf, at) => {
    slots.push(...leaf.missing);
    const isOdd = slots.length % 2 === 1;
    if (leaf.side === "right" ? !isOdd : isOdd) slots.push(isOneSide(leaf) && isOneSide(leaves[at - 1]) ? BREAK : null);
    slots.push(leaf);
    if (!isOneSide(leaf)) slots.push(null); // a whole opening, a single sheet
  });
  return slots;
}

/** @param {ContactSheet} sheet */
function cell(sheet) {
  /** @type {HTMLImageElement} */ const picture = h("img", { alt: "", width: 124, height: 150, loading: "lazy", decoding: "async", on: { error: () => picture.classList.add("gone") } });
  const label = h("span", { class: "card-label" });
  const level = icon("circle-help");
  const done = icon("check");
  const [out, same] = [icon("x"), icon("layers")];
  /** @type {HTMLElement} */ const element = h("div", { class: "leaf", role: "option", on: {
    click: (event) => sheet.click(Number(element.dataset.at), event),
    dblclick: () => sheet.open(),
    pointerdown: (event) => sheet.grab(Number(element.dataset.at), event),
  } }, picture, h("span", { class: "card-foot" }, label, same, out, done, level));
  return { element, show: (/** @type {SheetLeaf} */ leaf, /** @type {number} */ slot, /** @type {number} */ at, /** @type {number} */ total, /** @type {number} */ columns) => {
    const isBroken = sheet.slots[slot - 1] === BREAK;
    const row = store.rows.get(leaf.page);
    element.id = `leaf-${at}`;
    element.dataset.at = String(at);
    element.style.transform = sheet.placeOf(slot, columns);
    set(element, "aria-selected", String(sheet.chosen.has(leaf.name)));
    set(element, "data-active", at === sheet.at);
    set(element, "data-cut", sheet.cut.includes(leaf.name));
    set(element, "data-out", leaf.left_out);
    set(element, "aria-setsize", total);
    set(element, "aria-posinset", at + 1);
    set(element, "aria-label", [spoken(leaf, row), isBroken && t("sheet.break")].filter(Boolean).join(", "));
    set(element, "data-run", Boolean(leaf.run));
    set(element, "title", [leaf.run && runText(leaf.run), leaf.same.length && t("sheet.same", { names: leaf.same.join(", ") })].filter(Boolean).join("; ") || null);
    setText(label, leaf.label || "–");
    setIcon(level, levelIcon(row?.failed ? "red" : row?.level));
    set(level, "data-level", row?.level);
    out.classList.toggle("gone", !leaf.left_out);
    same.classList.toggle("gone", !leaf.same.length);
    done.classList.toggle("gone", !row?.accepted);
    const source = keyed(`/api/pictures/${leaf.event}/${leaf.layer}/thumbnail.jpg`);
    if (picture.getAttribute("src") === source) return;
    picture.classList.remove("gone");
    picture.src = source;
  } };
}

/** @param {SheetLeaf} leaf @param {Row} [row] */
function spoken(leaf, row) {
  return [t("sheet.leaf", { name: leaf.name, label: leaf.label || "–" }), row?.level && t(`level.${row.level}`), row?.accepted && t("state.accepted"),
    leaf.left_out && t("sheet.out"), leaf.same?.length && t("sheet.same", { names: leaf.same.join(", ") }), leaf.missing.length && t("sheet.missing", { labels: leaf.missing.join(", ") })].filter(Boolean).join(", ");
}

class ContactSheet {
  constructor() {
    /** @type {SheetLeaf[]} */ this.leaves = [];
    /** @type {Slot[]} */ this.slots = [];
    /** @type {number[]} */ this.places = [];
    this.at = 0;
    /** @type {Set<string>} */ this.chosen = new Set();
    /** @type {string[]} */ this.cut = [];
    this.view = "openings";
    /** @type {string} */ this.size = "medium";
    /** @type {ReturnType<typeof cell>[]} */ this.cells = [];
    /** @type {HTMLElement[]} */ this.gaps = [];
    /** @type {number} */ this.anchor = undefined;
    /** @type {number} */ this.tag = null;
    /** @type {number} */ this.cutFrom = null;
    this.asked = 0;
    this.sizer = h("div", { class: "sheet-sizer", role: "listbox", tabindex: "0", "data-first": "", "aria-multiselectable": "true", "aria-label": t("screen.sheet"),
      "data-own-keys": "", on: { keydown: (event) => this.key(event) } });
    this.scroller = h("div", { class: "sheet-scroller", on: { scroll: () => this.later() } }, this.sizer);
    this.views = segmented(t("sheet.view"), [["openings", t("sheet.openings")], ["singles", t("sheet.singles")]], (view) => { this.view = view; this.arrange(); });
    this.sizes = segmented(t("sheet.size"), Object.keys(SIZES).map((size) => [size, t(`sheet.${size}`)]), (size) => { this.size = size; this.arrange(); this.reveal(); });
    this.count = h("span", { class: "soft" });
    this.said = h("p", { class: "soft", role: "status" });
    this.input = h("input", { class: "leaf-label", maxlength: 100, autocomplete: "off", hidden: true, "aria-label": t("action.label"),
      on: { keydown: (event) => this.labelKey(event), blur: () => this.closeLabel() } });
    this.none = h("div", { class: "viewer-empty", hidden: true }, placeholder("first-page", t("page.none"), t("page.none.text")));
    this.element = h("div", { class: "screen sheet-screen" },
      h("div", { class: "viewer-head" }, h("h1", { class: "page-title", text: t("screen.sheet") }), this.count, this.views.element, this.sizes.element,
        button(t("sheet.cut"), { key: "^X", click: () => this.take() }), button(t("sheet.paste"), { key: "^V", click: () => this.paste() }),
        button(t("sheet.toggle"), { key: "Del", click: () => this.toggle() }), button(t("action.label"), { icon: "pencil", key: "F2", click: () => this.openLabel() }),
        button(t("sheet.run"), { icon: "list-ordered", key: "#", click: () => this.askRun() }), button(t("sheet.gap"), { icon: "plus", key: "+", click: () => this.askMissing() }),
        button(t("action.insert"), { icon: "between-vertical-start", key: "i", click: () => this.insert() })),
      this.said, this.none, this.scroller);
    for (const event of /** @type {(keyof StoreEvents)[]} */ (["rows", "row"])) on(event, () => { if (this.element.isConnected) this.load(); });
    new ResizeObserver(() => this.arrange()).observe(this.scroller);
  }

  enter() {
    this.load();
  }

  async load() {
    this.asked += 1;
    const { asked } = this;
    const found = await getOrNull("/api/leaves");
    if (found && asked === this.asked) this.takeOver(found);
  }

  /** @param {{tag: number, leaves: SheetLeaf[]}} options */
  takeOver({ tag, leaves }) {
    this.tag = tag;
    const active = this.leaves[this.at]?.name;
    this.leaves = leaves;
    this.at = Math.max(leaves.findIndex(({ name }) => name === active), 0);
    const names = new Set(leaves.map(({ name }) => name));
    this.chosen = new Set([...this.chosen].filter((name) => names.has(name)));
    this.cut = this.cut.filter((name) => names.has(name));
    this.arrange();
  }

  /** Between two openings, in px. */
  get gap() {
    return this.view === "openings" ? GAP : 0;
  }

  get width() {
    return SIZES[this.size];
  }

  get height() {
    return this.width + FOOT;
  }

  get columns() {
    const width = this.scroller.clientWidth - 2 * PADDING;
    if (this.view === "openings") return 2 * Math.max(Math.floor((width + GAP) / (2 * this.width + GAP)), 1);
    return Math.max(Math.floor(width / this.width), 1);
  }

  arrange() {
    this.slots = (this.view === "openings" ? openings : singles)(this.leaves);
    this.places = [];
    this.slots.forEach((leaf, slot) => { if (typeof leaf === "object" && leaf && "name" in leaf) this.places.push(slot); });
    this.views.show(this.view);
    this.sizes.show(this.size);
    this.scroller.style.setProperty("--leaf", `${this.width}px`);
    setText(this.count, number(this.leaves.length));
    this.none.hidden = this.leaves.length > 0;
    this.sizer.style.height = `${Math.ceil(this.slots.length / this.columns) * this.height}px`;
    this.sizer.style.width = `${this.columns * this.width + this.gap * (this.columns / 2 - 1)}px`;
    this.later();
  }

  later() {
    this.waiting ||= requestAnimationFrame(() => { this.waiting = 0; this.draw(); });
  }

  draw() {
    const { columns, scroller } = this;
    const [first, last] = [Math.floor(scroller.scrollTop / this.height) - SPARE, Math.ceil((scroller.scrollTop + scroller.clientHeight) / this.height) + SPARE];
    const seen = this.places.map((slot, at) => [slot, at]).filter(([slot]) => slot >= first * columns && slot < last * columns);
    while (this.cells.length < seen.length) this.sizer.append(this.cells[this.cells.push(cell(this)) - 1].element);
    this.cells.forEach(({ element }) => { element.hidden = true; });
    for (const [slot, at] of seen) {
      const one = this.cells[at % this.cells.length]; // a leaf keeps its element while the sheet scrolls
      one.element.hidden = false;
      one.show(this.leaves[at], slot, at, this.leaves.length, columns);
    }
    this.drawGaps(first * columns, last * columns);
    store.chosen = [...this.chosen];
    set(this.sizer, "aria-activedescendant", seen.some(([, at]) => at === this.at) ? `leaf-${this.at}` : null);
  }

  /** @param {number} slot @param {number} [columns] */
  placeOf(slot, columns = this.columns) {
    const column = slot % columns;
    return `translate(${column * this.width + this.gap * Math.floor(column / 2)}px, ${Math.floor(slot / columns) * this.height}px)`;
  }

  /** Draw missing leaves and breaks at some of the places; they are spoken with the leaf that follows. @param {number} start @param {number} end */
  drawGaps(start, end) {
    const labels = this.slots.slice(Math.max(start, 0), end).map((label, at) => ({ label, slot: Math.max(start, 0) + at })).filter(({ label }) => label === BREAK || typeof label === "string");
    while (this.gaps.length < labels.length) this.sizer.append(this.gaps[this.gaps.push(h("div", { class: "leaf-missing", "aria-hidden": "true" })) - 1]);
    this.gaps.forEach((element, at) => {
      element.hidden = at >= labels.length;
      if (element.hidden) return;
      const { label, slot } = labels[at];
      const isBreak = label === BREAK;
      setText(element, isBreak ? t("sheet.break") : label);
      set(element, "data-break", isBreak);
      element.style.transform = this.placeOf(slot);
    });
  }

  reveal() {
    const top = Math.floor((this.places[this.at] ?? 0) / this.columns) * this.height;
    const { scrollTop, clientHeight } = this.scroller;
    if (top < scrollTop) this.scroller.scrollTop = top;
    else if (top + this.height > scrollTop + clientHeight) this.scroller.scrollTop = top + this.height - clientHeight;
    this.later();
  }

  /** Make a leaf the active one; shift: choose all between, ctrl: choose it as well. @param {number} at @param {MouseEvent | KeyboardEvent} [event] */
  go(at, { shiftKey, ctrlKey, metaKey } = /** @type {MouseEvent | KeyboardEvent} */ ({})) {
    if (!this.leaves.length) return;
    const to = Math.min(Math.max(at, 0), this.leaves.length - 1);
    if (shiftKey) {
      const [low, high] = [Math.min(this.anchor ?? this.at, to), Math.max(this.anchor ?? this.at, to)];
      this.anchor ??= this.at;
      this.chosen = new Set(this.leaves.slice(low, high + 1).map(({ name }) => name));
    } else {
      this.anchor = to;
      if (ctrlKey || metaKey) this.choose(to);
    }
    this.at = to;
    this.reveal();
  }

  /** @param {number} at */
  choose(at) {
    const { name } = this.leaves[at];
    if (!this.chosen.delete(name)) this.chosen.add(name);
  }

  /** @param {number} at @param {MouseEvent} event */
  click(at, event) {
    if (this.isDragged?.()) return;
    if (!event.shiftKey && !event.ctrlKey && !event.metaKey) this.chosen = new Set([this.leaves[at].name]);
    this.go(at, event);
  }

  /** The leaves that an action is for: those chosen, else the active one. */
  get meant() {
    const chosen = this.leaves.filter(({ name }) => this.chosen.has(name));
    return chosen.length ? chosen : this.leaves.slice(this.at, this.at + 1);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { key, ctrlKey, metaKey } = event;
    const lines = this.columns;
    const steps = /** @type {Record<string, number>} */ ({ ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity })[key];
    /** @type {Record<string, () => unknown>} */ const acts = { ArrowDown: () => this.go(this.beyond(lines), event), ArrowUp: () => this.go(this.beyond(-lines), event),
      " ": () => { this.choose(this.at); this.later(); }, Delete: () => this.toggle(), F2: () => this.openLabel(), Enter: () => this.open(),
      "#": () => this.askRun(), "+": () => this.askMissing(), i: () => this.insert(), u: () => actions.undo(), U: () => actions.redo(), Escape: () => { this.chosen.clear(); this.cut = []; this.later(); } };
    if (!this.leaves.length) return;
    if (ctrlKey || metaKey) {
      if (key === "x") this.take();
      else if (key === "v") this.paste();
      else return;
    } else if (steps) this.go(this.at + steps, event);
    else if (acts[key]) acts[key]();
    else return;
    event.preventDefault();
  }

  /** The leaf nearest to the place that is so many places farther. @param {number} places */
  beyond(places) {
    const wanted = this.places[this.at] + places;
    if (wanted < 0) return this.at;
    const found = this.places.findIndex((slot) => slot >= wanted);
    return found < 0 ? (wanted >= this.slots.length + this.columns ? this.at : this.leaves.length - 1) : found;
  }

  take() {
    this.cut = this.meant.map(({ name }) => name);
    this.cutFrom = this.tag;
    setText(this.said, t("sheet.taken", { n: number(this.cut.length) }));
    this.later();
  }

  paste() {
    if (!this.cut.length) return setText(this.said, t("sheet.nothing"));
    return this.move(this.cut, this.leaves[this.at].name, this.cutFrom);
  }

  /** Move leaves before another one, in the order of a tag; where that is another one by now, the operator chooses. @param {string[]} names @param {string} before @param {number} tag */
  async move(names, before, tag) {
    if (names.includes(before)) return;
    const moved = (/** @type {string[]} */ all) => all.flatMap((/** @type {string} */ name) => (name === before ? [...names, name] : names.includes(name) ? [] : [name]));
    const found = await sendVersion(tag, (headers) => post("/api/order", { leaves: names, before }, headers),
      ({ leaves }) => {
        const theirs = leaves.map((/** @type {SheetLeaf} */ { name }) => name);
        return ordersApart(moved(theirs), theirs);
      });
    if (!found) return this.load();
    this.cut = [];
    setText(this.said, t("sheet.moved", { n: number(names.length), before: before ?? "–" }));
    return this.takeOver(found);
  }

  /** Leave the meant leaves out, or put them back where all of them are out. */
  async toggle() {
    const out = !this.meant.every((leaf) => leaf.left_out);
    for (const leaf of this.meant) {
      const found = await sendVersion(leaf.tag, (headers) => put("/api/leaves", { leaf: leaf.name, left_out: out }, headers),
        (current) => [spoken({ ...leaf, left_out: out }), spoken(current)]);
      if (!found) return this.load();
      this.takeOver(found);
    }
    return setText(this.said, t(out ? "sheet.went" : "sheet.returned"));
  }

  open() {
    if (this.leaves.length) location.hash = `#/page/${this.leaves[this.at].page}`;
  }

  openLabel() {
    const element = document.getElementById(`leaf-${this.at}`);
    if (!element) return;
    this.labelled = this.leaves[this.at];
    this.input.value = this.labelled.label;
    this.input.style.transform = element.style.transform;
    this.input.hidden = false;
    this.sizer.after(this.input);
    this.input.select();
    this.input.focus();
  }

  /** Number the leaves from the active one on. */
  askRun() {
    const [leaf, { tag }] = [this.leaves[this.at], this];
    if (leaf) openRun(leaf, (run) => this.change(tag, "/api/labels", { leaf: leaf.name, run }, [runText(run), (one) => runText(one.run)]));
  }

  /** Say which leaves are missing before the active one. */
  askMissing() {
    const [leaf, { tag }] = [this.leaves[this.at], this];
    const text = (/** @type {string[]} */ labels) => labels.join(", ") || "–";
    if (leaf) openMissing(leaf, (labels) => this.change(tag, "/api/missing", { before: leaf.name, labels }, [text(labels), (one) => text(one.missing)]));
  }

  /** Send a change of the arrangement of a tag: of a leaf, as a text, and as it is in the leaf by now. @param {number} tag @param {string} path @param {{leaf?: string, before?: string, run?: Run, labels?: string[]}} body @param {[string, (current: any) => string]} pair */
  async change(tag, path, body, [mine, theirs]) {
    const name = body.leaf ?? body.before;
    const found = await sendVersion(tag, (headers) => put(path, body, headers), ({ leaves }) => [mine, theirs(leaves.find((/** @type {{name: string}} */ one) => one.name === name) ?? {})]);
    if (found) this.takeOver(found);
    else this.load();
  }

  /** Capture a page, and put it before the active one. */
  insert() {
    if (!this.leaves.length) return;
    select(this.leaves[this.at].page);
    setText(this.said, reason("insert"));
    actions.insert();
  }

  closeLabel() {
    this.input.hidden = true;
  }

  /** @param {KeyboardEvent} event */
  async labelKey(event) {
    event.stopPropagation();
    if (event.key !== "Enter" && event.key !== "Escape") return;
    event.preventDefault();
    const [label, leaf] = [this.input.value.trim(), this.labelled];
    this.sizer.focus();
    if (event.key === "Escape") return;
    const found = await setLabel(leaf, label);
    if (found) this.takeOver(found);
  }

  /** Drag a leaf, or those that are chosen with it, before the one that it is dropped on. @param {number} at @param {PointerEvent} down */
  grab(at, down) {
    if (down.button !== 0) return;
    const [{ name }, { tag }] = [this.leaves[at], this];
    this.isDragged = follow(down, {
      over: (target) => { for (const { element } of this.cells) set(element, "data-over", element === target); },
      dropped: (target) => this.move(this.chosen.has(name) ? this.meant.map((leaf) => leaf.name) : [name], this.leaves[Number(target.dataset.at)].name, tag),
    });
    if (down.pointerType !== "touch") down.preventDefault();
    this.sizer.focus({ preventScroll: true });
  }
}

/** The screen, made once. */
export default function sheetScreen() {
  return new ContactSheet();
}

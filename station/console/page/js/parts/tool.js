// What all tools of corrections have: their fields, the values that these have now and where those come from.

import { button, h } from "../dom.js";
import { fieldText, isOfOneScan, present, sourceText, valueAt, valueText, withFields } from "../corrections.js";
import { t } from "../strings.js";

/**
 * A tool over the draft of a page. A tool has `name` (of its texts), `fields` of a page or a part, `otherwise` (where
 * a value comes from that no correction gives), and may have `body` and `keys` (key → act); `apply` opens the choice of further pages. `isStill`: the page is
 * shown as it was before.
 */
export class CorrectionTool {
  /** @param {import("../draft.js").Draft} draft @param {{name: string, fields: string[], otherwise?: string, body?: Content[]}} options */
  constructor(draft, { name, fields, otherwise = "", body = [] }) {
    this.draft = draft;
    this.fields = fields;
    this.otherwise = otherwise;
    this.part = "page";
    /** @type {Record<string, (event: KeyboardEvent) => unknown>} */ this.keys = {};
    /** @type {Row} */ this.row = null;
    /** @type {() => void} */ this.apply = null;
    this.isStill = false;
    this.now = h("ul", { class: "soft" });
    this.rest = h("div", { class: "row" }, button(t("tool.found"), { icon: "rotate-ccw", click: () => this.asFound() }),
      button(t("apply.more"), { key: "a", click: () => this.apply?.() }));
    this.element = h("section", { class: `tool-panel ${name}-tool`, "aria-label": t(`tool.${name}`) },
      h("h2", { text: t(`tool.${name}`) }), body, this.now, this.rest);
  }

  /** The paths of the fields; `part`, which they are of, is that of the leaf that is shown. */
  get paths() {
    return this.fields.map((name) => name.replace("part", `parts.${this.part}`));
  }

  /** The value of a field as it is with the draft; undefined: as found. @param {string} path */
  value(path) {
    const drafted = this.draft.value(path);
    if (drafted !== undefined && drafted !== null) return drafted;
    const { sources } = this.draft.base;
    return this.given(drafted === null ? sources.filter(({ source }) => source !== "page") : sources, path);
  }

  /** The value of a field by layers of corrections. @param {Source[]} sources @param {string} path */
  given(sources, path) {
    return present({ sources }, path)[0];
  }

  /** What is said of a field as it is without the draft: [value, source]. @param {string} path */
  state(path) {
    const [value, source] = present(this.draft.base, path);
    return [valueText(path, value), sourceText(source || this.otherwise)];
  }

  /** The fields that the page itself has, with the draft, and that fit other scans: [{path, value}]. */
  get own() {
    const table = withFields(this.draft.base?.edits, this.draft.fields);
    return this.paths.filter((path) => !isOfOneScan(path)).map((path) => ({ path, value: valueAt(table, path) })).filter(({ value }) => value !== undefined);
  }

  /** @param {Row} row @param {string} part */
  start(row, part) {
    this.row = row;
    this.part = part;
    this.show();
  }

  end() {
    this.ended();
  }

  /** What a tool does when another one is chosen, and when its values may have changed. */
  ended() {}

  shown() {}

  /** Whether the tool works on the scanner's picture. */
  get isOnScan() {
    return false;
  }

  show() {
    if (!this.draft.base || !this.row) return;
    const lines = this.paths.map((path) => {
      const [value, source] = this.state(path);
      const key = !source ? "tool.now.found" : this.paths.length > 1 ? "tool.now.of" : "tool.now";
      return t(key, { name: fieldText(path), value, source });
    });
    if (this.now.dataset.lines !== lines.join()) this.now.replaceChildren(...lines.map((text) => h("li", { text })));
    this.now.dataset.lines = lines.join();
    this.shown();
  }

  /** Change fields in the draft; a value that the page has already is not one. @param {Fields} fields */
  propose(fields) {
    if (!this.draft.base) return;
    const changed = Object.entries(fields).map(([path, value]) => [path, this.isSaved(path, value) ? undefined : value]);
    this.draft.set(Object.fromEntries(changed));
  }

  /** @param {string} path @param {any} value */
  isSaved(path, value) {
    const [saved, source] = present(this.draft.base, path);
    return value === null ? source !== "page" : JSON.stringify(saved) === JSON.stringify(value);
  }

  /** Take the page's own values away: then a rule, the preset or what was found holds. */
  asFound() {
    this.propose(Object.fromEntries(this.paths.map((path) => [path, /** @type {unknown} */ (null)])));
  }

  /** Act on a key; returns whether it did. @param {string} key @param {KeyboardEvent} event */
  key(key, event) {
    const act = this.keys[key];
    act?.(event);
    return Boolean(act);
  }
}

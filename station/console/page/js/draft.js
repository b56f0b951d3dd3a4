// A draft of corrections of one page: kept in this tab until it is saved or dropped, through a reload, too.

import { ApiError, getOrNull, put } from "./api.js";
import { isOfOneScan, withFields } from "./corrections.js";
import { errorText } from "./notices.js";
import { hindrance, store } from "./store.js";
import { t } from "./strings.js";

const KEPT = "planish-draft"; // sessionStorage: a tab has its own, and a reload keeps it
const OUTER = new Set(["by", "format", "version"]); // fields that correct nothing

const keyOf = (/** @type {number} */ page) => `${KEPT}/${store.state.session?.id}/${page}`;

/**
 * base: the corrections that the server has. fields: path → value, null takes a field away. made: {tag, capture} of
 * the corrections that the draft was begun on; another tag is of another window, or of another scan.
 */
export class Draft {
  /** @param {() => unknown} changed */
  constructor(changed) {
    this.changed = changed;
    /** @type {Row} */ this.row = null;
    /** @type {PageEdits} */ this.base = null;
    /** @type {Fields} */ this.fields = {};
    /** @type {{tag: number, capture: number}} */ this.made = null;
    this.said = "";
    this.asked = 0;
    this.sent = false;
  }

  get isOpen() {
    return Object.keys(this.fields).length > 0;
  }

  /** Whether the page was corrected or captured again since the draft was begun. */
  get isContested() {
    return this.isOpen && this.base?.tag !== this.made.tag;
  }

  /** Fields of the draft that were drawn on an earlier scan. */
  get stale() {
    return this.isOpen && this.base?.capture !== this.made.capture ? Object.keys(this.fields).filter(isOfOneScan) : [];
  }

  /** The value of a field: of the draft where it has one, else undefined; null where it is taken away. @param {string} path */
  value(path) {
    return this.fields[path];
  }

  /** Take up a page: its corrections, and the draft that this tab keeps of it. @param {Row} row */
  async load(row) {
    if (this.row?.page !== row.page) this.open(row);
    this.row = row;
    this.asked += 1;
    const { asked } = this;
    const answer = await getOrNull(`/api/pages/${row.page}/edits`);
    if (asked !== this.asked || this.sent || !answer) return; // newer ones are on their way
    this.base = answer;
    this.changed();
  }

  /** @param {Row} row */
  open(row) {
    const kept = JSON.parse(sessionStorage.getItem(keyOf(row.page)));
    this.base = null;
    this.fields = kept?.fields ?? {};
    this.made = kept?.made ?? null;
    this.said = kept ? t("draft.kept") : "";
    this.changed();
  }

  /** Change fields of the draft; undefined takes a field out of it. @param {Fields} fields */
  set(fields) {
    if (!this.base) return;
    if (!this.isOpen) this.made = { tag: this.base.tag, capture: this.base.capture };
    const all = Object.entries({ ...this.fields, ...fields }).filter(([, value]) => value !== undefined);
    this.fields = Object.fromEntries(all);
    this.keep("");
  }

  /** @param {string} said */
  keep(said) {
    this.said = said;
    if (this.isOpen) sessionStorage.setItem(keyOf(this.row.page), JSON.stringify({ fields: this.fields, made: this.made }));
    else sessionStorage.removeItem(keyOf(this.row.page));
    this.changed();
  }

  drop() {
    this.fields = {};
    this.keep(t("draft.dropped"));
  }

  /** Put the draft on the corrections that another window saved, but for what was drawn on an earlier scan. */
  async keepMine() {
    for (const path of this.stale) delete this.fields[path];
    this.made = { tag: this.base.tag, capture: this.base.capture };
    this.keep("");
    await this.save();
  }

  async save() {
    const why = hindrance();
    if (why) return this.say(t(why));
    if (this.sent || !this.isOpen || !this.base || this.isContested) return undefined;
    this.sent = true; // a second one would be refused for the tag that the first one changes
    const [{ page, restore }, { edits }, { tag }] = [this.row, this.base, this.made];
    const wanted = withFields(edits, this.fields);
    const body = Object.keys(wanted).every((name) => OUTER.has(name)) ? null : { ...wanted, by: { ...edits?.by, tool: "console", saw: restore } };
    try {
      const answer = await put(`/api/pages/${page}/edits`, { edits: body }, { "If-Match": `"${tag}"` });
      this.settle(page, answer, true);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (error.status === 412) this.settle(page, error.data.current, false);
      else this.say(errorText(error));
    } finally {
      this.sent = false;
    }
    return undefined;
  }

  /** Take over the server's answer, unless another page is looked at by now. @param {number} page @param {PageEdits} answer @param {boolean} saved */
  settle(page, answer, saved) {
    if (saved) sessionStorage.removeItem(keyOf(page));
    if (this.row.page !== page) return;
    this.base = answer;
    if (saved) this.fields = {};
    this.keep(saved ? t("draft.saved") : "");
  }

  /** @param {string} text */
  say(text) {
    this.said = text;
    this.changed();
  }
}

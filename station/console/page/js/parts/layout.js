// One page or two: a draft until it is saved, with where the present value comes from.

import { ApiError, get, put } from "../api.js";
import { button, h, segmented, setText } from "../dom.js";
import { number } from "../format.js";
import { errorText } from "../notices.js";
import { hindrance } from "../store.js";
import { t } from "../strings.js";

const KEYS = { 0: "whole", 1: "left", 2: "split", 3: "right" };
const CHOICES = ["whole", "left", "split", "right", "auto"];

/** The layout that corrections give a page, and where it comes from: [layout, source]. */
function present(told) {
  const giving = told.sources.filter(({ edits }) => edits.layout || edits.spine).at(-1);
  if (!giving) return [told.preset_layout === "single" ? "whole" : told.preset_layout, t("source.preset")];
  const [kind, id] = giving.source.split(" ");
  return [giving.edits.layout ?? "split", kind === "rule" ? t("source.rule", { n: id }) : t("source.page")];
}

/** The tool; `element` is its panel, `key` acts on a key and returns whether it did. */
export class LayoutTool {
  constructor() {
    this.choice = segmented(t("tool.spine"), CHOICES.map((name) => [name, t(`layout.${name}`)]), (name) => this.propose(name));
    this.now = h("p", { class: "soft" });
    this.found = h("p", { class: "soft" });
    this.told = h("p", { role: "status" });
    this.saving = h("div", { class: "row", hidden: true }, button(t("save"), { key: "↵", kind: "primary", click: () => this.save() }),
      button(t("layout.drop"), { key: "Esc", click: () => this.drop() }));
    this.theirs = h("div", { class: "row", hidden: true }, button(t("layout.mine"), { click: () => this.save(this.other.tag) }),
      button(t("layout.other"), { click: () => this.take() }));
    this.element = h("section", { class: "tool-panel layout-tool", "aria-label": t("tool.spine") }, h("h2", { text: t("tool.spine") }),
      this.choice.element, this.now, this.found, this.told, this.saving, this.theirs);
  }

  async start(row) {
    const same = this.row?.page === row.page;
    this.row = row;
    if (same && this.draft) return this.show(); // of an earlier scan, too: its tag is refused, and both are shown
    this.draft = this.other = null;
    if (!same) for (const line of [this.now, this.found, this.told]) setText(line, "");
    const [told, layout] = await Promise.all([get(`/api/pages/${row.page}/edits`).catch(() => null), get(`/api/pages/${row.page}/layout`).catch(() => null)]);
    if (this.row !== row) return undefined;
    this.base = told;
    const [left, right] = layout?.widths_mm ?? [];
    setText(this.found, !layout ? "" : left === undefined ? t("layout.none")
      : t("layout.found", { left: number(left, 1), right: number(right, 1), sigma: number(layout.sigma_mm ?? 0, 1) }));
    return this.show();
  }

  show() {
    if (!this.base) return;
    const [layout, source] = present(this.base);
    this.choice.show(this.draft ?? layout);
    setText(this.now, t("layout.now", { layout: t(`layout.${layout}`), source }));
    this.saving.hidden = !this.draft || Boolean(this.other);
    this.theirs.hidden = !this.other;
    if (this.draft && !this.other) setText(this.told, t("layout.draft", { layout: t(`layout.${this.draft}`) }));
  }

  propose(name) {
    if (!this.base) return;
    this.draft = name;
    this.show();
  }

  drop() {
    this.draft = this.other = null;
    setText(this.told, t("layout.dropped"));
    this.show();
  }

  take() {
    this.base = this.other;
    this.drop();
  }

  async save(tag = this.base.tag) {
    const why = hindrance();
    if (why) return setText(this.told, t(why));
    if (this.sent) return undefined; // a second one would be refused for the tag that the first one changes
    this.sent = true;
    const { edits } = this.other ?? this.base;
    const wanted = { ...edits, layout: this.draft, by: { ...edits?.by, tool: "console", saw: this.row.restore } };
    try {
      this.base = await put(`/api/pages/${this.row.page}/edits`, { edits: wanted }, { "If-Match": `"${tag}"` });
      this.draft = this.other = null;
      setText(this.told, t("layout.saved"));
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      this.other = error.status === 412 ? error.data.current : this.other;
      setText(this.told, error.status === 412 ? t("layout.conflict", { mine: t(`layout.${this.draft}`), other: t(`layout.${present(this.other)[0]}`) }) : errorText(error));
    } finally {
      this.sent = false;
    }
    return this.show();
  }

  /** Act on a key while the tool is open. */
  key(key) {
    if (KEYS[key]) this.propose(KEYS[key]);
    else if (key === "Enter" && this.draft) { if (!this.other) this.save(); }
    else if (key === "Escape" && this.draft) this.drop();
    else return false;
    return true;
  }
}

// The draft of a page: what it changes, from what, and the version of another window where there is one.

import { button, h, setText } from "../dom.js";
import { fieldText, present, valueText } from "../corrections.js";
import { t } from "../strings.js";

/** The panel; `show` follows the draft. @param {import("../draft.js").Draft} draft */
export function draftPanel(draft) {
  const title = h("h2", { text: t("draft") });
  const lines = h("ul", { class: "draft-lines" });
  const status = h("p", { role: "status" });
  const saving = h("div", { class: "row" }, button(t("save"), { key: "↵", kind: "primary", click: () => draft.save() }),
    button(t("draft.drop"), { key: "Esc", click: () => draft.drop() }));
  const choosing = h("div", { class: "row" }, button(t("draft.mine"), { click: () => draft.keepMine() }),
    button(t("draft.theirs"), { click: () => draft.drop() }));
  const element = h("section", { class: "tool-panel draft-panel", "aria-label": t("draft") }, title, lines, status, saving, choosing);
  return { element, show: () => {
    const { base, isOpen, isContested, stale } = draft;
    element.hidden = !isOpen && !draft.said;
    title.hidden = !isOpen;
    lines.replaceChildren(...Object.entries(draft.fields).map(([path, value]) => h("li", {}, h("strong", { text: fieldText(path) }), " ",
      t(isContested ? "draft.both" : "draft.line", { mine: valueText(path, value), other: base ? valueText(path, present(base, path)[0]) : "…" }))));
    saving.hidden = !isOpen || isContested;
    choosing.hidden = !isContested;
    setText(status, stale.length ? t("draft.stale", { fields: stale.map(fieldText).join(", ") }) : isContested ? t("draft.contested") : draft.said);
  } };
}

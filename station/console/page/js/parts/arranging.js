// Questions of the contact sheet: how the leaves are numbered from one on, and which ones are missing before it.

import { field, openDialog } from "../dialog.js";
import { h } from "../dom.js";
import { t } from "../strings.js";

const STYLES = ["arabic", "roman", "ROMAN", "letters", "LETTERS", "folio", "folio-ab", "leaf", "column", "none"];
const SIDES = ["recto", "verso"];
const NEW = { style: "arabic", first: 1, side: "recto", prefix: "", suffix: "", bracket: false, counted: true };
const AFFIX = { maxlength: 20, autocomplete: "off", size: 4 };

/** A run of labels in the reader's language; null: none begins there. @param {Run} run */
export function runText(run) {
  return run ? [t(`run.${run.style}`), run.first, t(`run.${run.side}`), run.prefix, run.suffix, run.bracket ? "[ ]" : ""].filter(Boolean).join(" · ") : t("run.on");
}

/** @param {string[]} names @param {string} chosen */
function choice(names, chosen) {
  const select = h("select", {}, names.map((value) => h("option", { value, text: t(`run.${value || "on"}`) })));
  select.value = chosen;
  return select;
}

/** Ask for the run that begins at a leaf; `send` gets it, or null. @param {SheetLeaf} leaf @param {(run: Run) => unknown} send */
export function openRun(leaf, send) {
  const run = leaf.run ?? NEW;
  const style = choice(["", ...STYLES], leaf.run ? run.style : "arabic");
  const first = h("input", { type: "number", min: 0, max: 100_000, step: 1, required: true, value: run.first });
  const side = choice(SIDES, run.side);
  const [prefix, suffix] = [run.prefix, run.suffix].map((value) => h("input", { ...AFFIX, value }));
  const bracket = h("input", { type: "checkbox", id: "run-bracket" });
  bracket.checked = run.bracket;
  openDialog(t("run.title", { name: leaf.name }), [field(t("run.style"), style), h("div", { class: "pair" }, field(t("run.first"), first), field(t("run.side"), side)),
    h("div", { class: "pair" }, field(t("run.prefix"), prefix), field(t("run.suffix"), suffix)),
    h("label", { class: "check", for: bracket.id }, bracket, h("span", { text: t("run.bracket") }))],
  { ok: t("save"), send: () => send(style.value ? { ...run, style: style.value, first: Number(first.value), side: side.value,
    prefix: prefix.value, suffix: suffix.value, bracket: bracket.checked } : null) });
}

/** Ask for the labels of the leaves that are missing before one; `send` gets them. @param {SheetLeaf} leaf @param {(labels: string[]) => unknown} send */
export function openMissing(leaf, send) {
  const input = h("input", { maxlength: 500, autocomplete: "off", value: leaf.missing.join(", ") });
  openDialog(t("missing.before", { name: leaf.name }), [field(t("missing.labels"), input, t("missing.hint"))],
    { ok: t("save"), send: () => send(input.value.split(",").map((label) => label.trim()).filter(Boolean)) });
}

// What the operator can do with a page: the same by button, key and foot-switch.

import { field, openDialog } from "./dialog.js";
import { able, button, h } from "./dom.js";
import { pageName } from "./format.js";
import { seeBoth } from "./parts/both.js";
import { setLabel } from "./parts/versions.js";
import { current, hindrance, on, press, select, store } from "./store.js";
import { t } from "./strings.js";

/** @type {Record<string, string[]>} */
const PARTS = { // icon, key, and what must be there
  capture: ["camera", "␣", "scanner"], again: ["repeat-2", "r", "scanner page"], accept: ["check", "↵", "page"],
  insert: ["between-vertical-start", "i", "scanner page"], mark: ["bookmark", "m", "page"], note: ["sticky-note", "n", "page"],
  undo: ["undo-2", "u", "undo"], redo: ["redo-2", "U", "redo"], preview: ["eye", "p", "scanner"], label: ["pencil", "", "page"], both: ["columns-2", "b", "page"],
};

/** Why an action cannot be done now, in the reader's language; empty when it can. @param {string} name */
export function reason(name) {
  const why = hindrance();
  if (why) return t(why);
  const needs = PARTS[name][2].split(" ");
  const { scanner, session } = store.state;
  if (needs.includes("scanner") && !scanner.configured) return t("why.scanner");
  if (needs.includes("scanner") && scanner.busy) return t("why.busy");
  if (needs.includes("page") && !current()) return t("why.page");
  if ((name === "undo" || name === "redo") && !session[/** @type {"undo" | "redo"} */ (name)]) return t("why.nothing");
  return "";
}

/** @param {string} name */
function onPage(name) {
  return async () => {
    const page = current();
    if (!reason(name)) await press(name, page ? { page: page.page } : {});
  };
}

function askNote() {
  if (reason("note")) return;
  const page = current();
  const input = h("textarea", { rows: 3, maxlength: 2000 });
  input.value = page.note;
  openDialog(`${t("action.note")} · ${pageName(page)}`, [field(t("ask.note"), input)],
    { ok: t("save"), send: () => press("note", { page: page.page, text: input.value.trim() }) });
}

function askLabels() {
  if (reason("label")) return;
  const page = current();
  const leaves = page.parts.map((leaf) => ({ leaf, input: h("input", { maxlength: 100, autocomplete: "off", value: leaf.label }) }));
  const send = async () => {
    for (const { leaf, input } of leaves) if (input.value.trim() !== leaf.label) await setLabel(leaf, input.value.trim());
  };
  openDialog(`${t("action.label")} · ${pageName(page)}`, leaves.map(({ leaf, input }) =>
    field([t("ask.label"), leaf.part !== "page" && `(${t(`side.${leaf.part}`)})`].filter(Boolean).join(" "), input)), { ok: t("save"), send });
}

const plain = (/** @type {string} */ name) => () => { if (!reason(name)) press(name); };

/** Each action by its name, to be called without arguments. @type {Record<string, () => unknown>} */
export const actions = {
  capture: () => { if (!reason("capture")) { select(null); press("capture"); } },
  preview: plain("preview"), undo: plain("undo"), redo: plain("redo"),
  again: onPage("again"), accept: onPage("accept"), mark: onPage("mark"), insert: onPage("insert"),
  note: askNote, label: askLabels, both: seeBoth,
};

/** A button that does an action and says why it cannot. @param {string} name @param {string} [kind] */
export function actionButton(name, kind = "") {
  const [picture, key] = PARTS[name];
  const element = button(t(`action.${name}`), { icon: picture, key, kind, click: () => actions[name]() });
  element.dataset.action = name;
  const update = () => {
    able(element, reason(name));
    const page = current();
    if (name === "accept") element.setAttribute("aria-pressed", String(Boolean(page?.accepted)));
    if (name === "mark") element.setAttribute("aria-pressed", String(Boolean(page?.marked)));
  };
  for (const event of /** @type {(keyof StoreEvents)[]} */ (["state", "online", "row", "rows", "selected"])) on(event, update);
  update();
  return element;
}

/** The buttons of some actions, with undo and redo side by side as the last. @param {string[]} names */
export function actionPad(names) {
  return h("div", { class: "actions" }, names.map((name) => actionButton(name)),
    h("div", { class: "actions-pair" }, actionButton("undo", "short"), actionButton("redo", "short")));
}

// Corrections of a page put on many: which fields, which pages and leaves; one step, and one undo.

import { post } from "../api.js";
import { fieldText, valueText, withFields } from "../corrections.js";
import { field, openDialog } from "../dialog.js";
import { h } from "../dom.js";
import { number, pageName } from "../format.js";
import { errorText } from "../notices.js";
import { attempt, hindrance, store } from "../store.js";
import { t } from "../strings.js";

const TARGETS = ["this", "following", "all", "selected"];
const SIDES = ["any", "left", "right"];
const PARTS = ["page", "left", "right"];
const MANY = 12; // pages that are named one by one

/** The numbers of "3, 5-8"; null for what cannot be read. @param {string} text */
export function pagesOf(text) {
  /** @type {number[]} */ const found = [];
  for (const part of text.split(",")) {
    const [, first, last] = part.trim().match(/^(\d{1,4})(?:\s*[-–]\s*(\d{1,4}))?$/) ?? [];
    if (!first) return null;
    for (let page = Number(first); page <= Number(last ?? first); page += 1) found.push(page);
  }
  return found;
}

/** Fields by their paths, put on the leaves of a side; "any": on both, and on whole pages. @param {Fields} fields @param {string} side */
export function editsFor(fields, side) {
  const spread = Object.entries(fields).flatMap(([path, value]) => {
    const [, rest] = path.match(/^parts\.\w+\.(.+)$/) ?? [];
    return rest ? (side === "any" ? PARTS : [side]).map((part) => [`parts.${part}.${rest}`, value]) : [[path, value]];
  });
  return withFields({}, Object.fromEntries(spread));
}

/** The pages of leaves by their names, as `pagesOf` reads them. @param {string[]} names */
export function pagesText(names) {
  const pages = [...new Set(names.map((name) => parseInt(name, 10)))].sort((one, two) => one - two);
  const starts = pages.filter((page) => !pages.includes(page - 1));
  const ends = pages.filter((page) => !pages.includes(page + 1));
  return starts.map((page, at) => (page === ends[at] ? String(page) : `${page}-${ends[at]}`)).join(", ");
}

/** @param {string} target @param {Row} row @param {string} text */
function capturesOf(target, row, text) {
  const rows = [...store.rows.values()].sort((one, two) => one.order - two.order);
  const wanted = /** @type {Record<string, Row[]>} */ ({ this: [row], following: rows.filter(({ order }) => order >= row.order),
    selected: pagesOf(text)?.map((page) => store.rows.get(page)) })[target];
  if (!wanted?.length || wanted.includes(undefined)) return null;
  return wanted.map(({ capture }) => capture);
}

/** @param {string} label @param {string} name @param {[string, string][]} choices @param {string} chosen @param {() => unknown} changed */
function radios(label, name, choices, chosen, changed) {
  const inputs = choices.map(([value, text]) => {
    const input = h("input", { type: "radio", name, value, id: `${name}-${value}`, on: { change: changed } });
    input.checked = value === chosen;
    return h("label", { class: "check", for: input.id }, input, h("span", { text }));
  });
  return h("fieldset", { class: "choices" }, h("legend", { text: label }), inputs);
}

const chosenOf = (/** @type {Element} */ group) => /** @type {HTMLInputElement} */ (group.querySelector(":checked")).value;

/** @param {Offer[]} offered @param {() => unknown} changed */
function boxes(offered, changed) {
  return offered.map(({ path, value, isChosen }, at) => {
    const input = h("input", { type: "checkbox", id: `apply-field-${at}`, value: path, on: { change: changed } });
    input.checked = isChosen;
    return h("label", { class: "check", for: input.id }, input, h("span", { text: `${fieldText(path)}: ${valueText(path, value)}` }));
  });
}

/** The pages of a plan, and those that keep their own; `over`: pages that are ticked, and give way. @param {{pages: number[], own: Record<string, string[]>}} options @param {Set<string>} over */
function plannedLines({ pages, own }, over) {
  const kept = Object.entries(own).map(([page, fields]) => {
    /** @type {HTMLInputElement} */ const input = h("input", { type: "checkbox", id: `apply-over-${page}`, on: { change: () => (input.checked ? over.add(page) : over.delete(page)) } });
    input.checked = over.has(page);
    const text = t("apply.own", { page: pageName(store.rows.get(Number(page))), fields: fields.map(fieldText).join(", ") });
    return h("li", {}, h("span", { text }), " ", h("label", { class: "check", for: input.id }, input, h("span", { text: t("apply.over") })));
  });
  const named = pages.length > MANY ? "" : pages.map((page) => pageName(store.rows.get(page))).join(", ");
  return [h("li", { text: t("apply.pages", { n: number(pages.length) }) + (named && `: ${named}`) }), ...kept];
}

/** Ask for the pages. fields: [{path, value, isChosen}], of which the operator chooses; `done` gets what the server made and its edits. @param {Row} row @param {string} part @param {Offer[]} fields @param {(made: {pages: number[], own: Record<string, string[]>}, edits: Edits) => void} done */
export function openApply(row, part, fields, done) {
  const planned = h("ul", { class: "soft" });
  /** @type {Set<string>} */ const over = new Set(); // pages whose own corrections give way
  let asked = 0;
  /** @type {Record<string, string[]>} */ let own = {};
  const changed = () => show();
  const checks = h("fieldset", { class: "choices" }, h("legend", { text: t("apply.fields") }), boxes(fields, changed));
  const targets = radios(t("apply.to"), "apply", TARGETS.map((name) => [name, t(`apply.${name}`)]), "following", changed);
  const sides = radios(t("leaf"), "leaves", SIDES.map((name) => [name, t(`leaves.${name}`)]), part === "page" ? "any" : part, changed);
  const selected = h("input", { maxlength: 2000, autocomplete: "off", value: pagesText(store.chosen), on: { input: changed } });
  const named = field(t("apply.numbers"), selected);
  const later = h("input", { type: "checkbox", id: "apply-future", on: { change: changed } });
  const rule = () => {
    const chosen = [.../** @type {NodeListOf<HTMLInputElement>} */ (checks.querySelectorAll(":checked"))].map((one) => fields.find(({ path }) => path === one.value));
    const target = chosenOf(targets);
    const captures = target === "all" ? "all" : capturesOf(target, row, selected.value);
    if (!captures || !chosen.length) return null;
    const edits = editsFor(Object.fromEntries(chosen.map(({ path, value }) => [path, value])), chosenOf(sides));
    return { scope: /** @type {{captures: "all" | number[], future: boolean, over?: number[]}} */ ({ captures, future: later.checked }), edits };
  };
  const show = async () => {
    named.hidden = chosenOf(targets) !== "selected";
    asked += 1;
    const [wanted, mine] = [rule(), asked];
    const plan = wanted && await post("/api/rules/plan", wanted).catch((error) => ({ error }));
    if (mine !== asked) return;
    own = plan?.own ?? {};
    planned.replaceChildren(...(plan && !plan.error ? plannedLines(plan, over) : [h("li", { text: plan ? errorText(plan.error) : t("apply.none") })]));
  };
  const send = async () => {
    const [wanted, why] = [rule(), hindrance()];
    if (!wanted || why) {
      planned.replaceChildren(h("li", { text: t(why || "apply.none") }));
      return false;
    }
    const ticked = [...over].filter((page) => own[page]).map((page) => store.rows.get(Number(page)).capture);
    if (ticked.length) wanted.scope.over = ticked;
    const made = await attempt(() => post("/api/rules", wanted));
    if (made) done(made, wanted.edits);
    return Boolean(made);
  };
  show();
  return openDialog(t("apply.title"), [checks, targets, named, sides,
    h("label", { class: "check", for: "apply-future" }, later, h("span", { text: t("apply.future") })), h("div", { role: "status" }, planned)], { ok: t("apply"), send });
}

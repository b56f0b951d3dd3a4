// Leaves that ask the operator for a correction, and the way from one to the next.

import { h, button, setText } from "../dom.js";
import { number } from "../format.js";
import { store } from "../store.js";
import { t } from "../strings.js";

/** @type {Record<string, number>} */ const PLACES = { left: 1, right: 2 }; // of the leaves of a page; what is asked of the whole page comes first

/** All leaves that ask, in the order of the strip: [{page, part}]; part "": the whole page. */
export function asking() {
  return store.order.flatMap((page) => {
    const parts = new Set(store.rows.get(page).asks?.map(({ part }) => part));
    return [...parts].sort((one, two) => (PLACES[one] ?? 0) - (PLACES[two] ?? 0)).map((part) => ({ page, part }));
  });
}

/** The one that asks next, or before; from the last on to the first. Null where none asks. @param {number} step @param {number} page @param {string} part */
export function nextAsking(step, page, part) {
  const all = asking();
  const place = (/** @type {{page: number, part: string}} */ one) => 3 * store.order.indexOf(one.page) + (PLACES[one.part] ?? 0);
  const here = place({ page, part });
  const found = step > 0 ? all.find((one) => place(one) > here) : all.findLast((one) => place(one) < here);
  return found ?? all.at(step > 0 ? 0 : -1) ?? null;
}

/** A row with how many leaves ask and its two buttons; `go` gets the step. @param {(step: number) => unknown} go */
export function askList(go) {
  const count = h("span", { class: "soft" });
  const element = h("div", { class: "row asks" }, count, button(t("asks.before"), { key: "k", click: () => go(-1) }),
    button(t("asks.next"), { key: "j", click: () => go(1) }));
  return { element, show: () => {
    const { length } = asking();
    element.hidden = length === 0;
    setText(count, t("asks.count", { n: number(length) }));
  } };
}

// A page that looks the same as an earlier one: both side by side, and the decision to keep both.

import { keyed } from "../api.js";
import { openDialog } from "../dialog.js";
import { h } from "../dom.js";
import { pageName } from "../format.js";
import { details } from "./details.js";
import { pictureLayers } from "./leaves.js";
import { current, press, store } from "../store.js";
import { t } from "../strings.js";

/** The finding that says most of a page's likeness to another one: that which is not answered comes first. @param {Row} row @param {Finding[]} findings */
export function sameFinding(row, findings) {
  const kept = (/** @type {Finding} */ one) => Number(row?.kept?.includes(one.same_as) ?? false);
  return (findings ?? []).filter(({ name }) => name === "similarity").sort((one, two) => kept(one) - kept(two) || two.value - one.value)[0] ?? null;
}

/** A page as "5/left" in the reader's language. @param {string} leaf */
export function leafName(leaf) {
  const [page, part] = leaf.split("/");
  return [pageName(store.rows.get(Number(page)) ?? { page: Number(page) }), part && t(`side.${part}`)].filter(Boolean).join(", ");
}

/** @param {string} leaf */
function figure(leaf) {
  const [page, part] = leaf.split("/");
  const layers = pictureLayers(store.rows.get(Number(page)));
  const { event, layer } = layers.find((one) => one.layer === `${part}.page`) ?? layers[0];
  return h("figure", {}, h("img", { src: keyed(`/api/pictures/${event}/${layer}/full`), alt: "" }), h("figcaption", { text: leafName(leaf) }));
}

/** Show the page that is looked at next to the one that it looks the same as. */
export async function seeBoth() {
  const row = current();
  const found = sameFinding(row, row && (await details(row))?.checks);
  if (!found?.same_as || !store.rows.has(Number.parseInt(found.same_as, 10))) return;
  const leaf = found.part ? `${row.page}/${found.part}` : String(row.page);
  openDialog(t("same.title"), h("div", { class: "both" }, [found.same_as, leaf].map(figure)),
    { ok: t("same.keep"), send: () => press("keep_both", { page: row.page }), cancel: t("close") });
}

// Changes of what has a tag: where another window was first, both versions are shown, and the operator chooses.

import { put } from "../api.js";
import { openDialog } from "../dialog.js";
import { h } from "../dom.js";
import { attempt } from "../store.js";
import { t } from "../strings.js";

const NAMED = 12; // leaves of an order that are named one by one

/** Ask which of two versions holds; closing the question keeps that of the other window. @param {string[]} pair */
function isMine([mine, other]) {
  return new Promise((resolve) => {
    let kept = false;
    openDialog(t("versions"), [h("p", { text: t("versions.text") }), h("ul", {}, h("li", { text: t("versions.mine", { version: mine }) }),
      h("li", { text: t("versions.theirs", { version: other }) }))],
    { ok: t("draft.mine"), cancel: t("draft.theirs"), send: () => { kept = true; } }).addEventListener("close", () => resolve(kept));
  });
}

/**
 * Send a change that was made from values of a tag: `send` gets the headers, `both` the present values and gives the
 * two versions as texts. Returns the server's answer; null where it refused, or where the other version holds.
 * @param {number} tag @param {(headers: HeaderFields) => Promise<any>} send @param {(current: any) => string[]} both
 */
export async function sendVersion(tag, send, both) {
  const found = await attempt(() => send({ "If-Match": `"${tag}"` }).catch((error) => {
    if (error.status !== 412) throw error;
    return { contested: error.data.current };
  }));
  if (!found?.contested) return found;
  const versions = both(found.contested);
  if (versions[0] === versions[1] || !(await isMine(versions))) return null;
  return sendVersion(found.contested.tag, send, both);
}

/** Label a leaf. @param {{tag: number, name: string}} leaf @param {string} label */
export function setLabel(leaf, label) {
  return sendVersion(leaf.tag, (headers) => put("/api/leaves", { leaf: leaf.name, label }, headers), (current) => [label || "–", current.label || "–"]);
}

/** Two orders of names as texts, from the first place where they differ to the last. @param {string[]} mine @param {string[]} theirs */
export function ordersApart(mine, theirs) {
  const [last, other] = [mine.toReversed(), theirs.toReversed()];
  const differing = (/** @type {string[]} */ one, /** @type {string[]} */ two) => Math.max(one.findIndex((/** @type {string} */ name, /** @type {number} */ at) => name !== two[at]), 0);
  const [first, after] = [differing(mine, theirs), differing(last, other)];
  return [mine, theirs].map((names) => {
    const apart = names.slice(first, names.length - after);
    return [...apart.slice(0, NAMED), ...(apart.length > NAMED ? ["…"] : [])].join(", ");
  });
}

// Faults of the scanner, the session and jobs, in the reader's language.

import { h } from "./dom.js";
import { known, language, t } from "./strings.js";

const SERVER = "en"; // the language of the server's own sentences, which have the facts

/** The key of a fault that the table of strings has: its narrowest kind, else `otherwise`. @param {Fault} fault @param {string} otherwise */
function keyOf({ kinds = [] }, otherwise) {
  return [...kinds.map((kind) => `fault.${kind}`), otherwise].find(known);
}

/** What went wrong and what to do: elements for the reader; the server's own sentence stands behind a translation. @param {Fault} fault @param {string} [otherwise] */
export function faultText(fault, otherwise = "") {
  const own = `${fault.text} ${fault.hint ?? ""}`.trim();
  const key = keyOf(fault, otherwise);
  if (language() === SERVER || !key) return [h("span", { lang: SERVER, text: own })];
  return [h("span", { text: t(key) }), " ", h("span", { class: "soft", lang: SERVER, text: `(${own})` })];
}

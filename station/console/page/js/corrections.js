// Corrections as fields: "layout", "parts.left.turn". What a page has, and which layer it comes from.

import { number } from "./format.js";
import { t } from "./strings.js";

const OF_ONE_SCAN = new Set(["spine", "outline", "masks"]); // drawn on the image of one scan: they fit no other one
const OF_PRESET = new Set(["layout", "shading"]);
/** @type {Record<string, (value: any) => string>} */
const TEXTS = { // field → its value in the reader's language
  layout: (value) => t(`layout.${value}`),
  turn: (value) => `${number(90 * value)}°`,
  rotate_deg: (value) => `${number(value, 2)}°`,
  shading: (value) => t(`light.${value}`),
  spine: (value) => t("value.points", { n: value.length }),
  outline: (value) => t("value.points", { n: value.length }),
  masks: (value) => number(value.length),
  crop: ({ mode, margin_mm: margin, box }) => [t(`crop.${mode}`), margin && `${number(margin, 2)} mm`,
    box?.map((/** @type {number} */ side) => number(side, 1)).join(" · ")].filter(Boolean).join(" "),
};

const nameOf = (/** @type {string} */ path) => path.split(".").at(-1);

/** The value of a field; undefined where the corrections do not give it. @param {Edits} edits @param {string} path @returns {any} */
export function valueAt(edits, path) {
  return path.split(".").reduce((table, key) => table?.[key], edits ?? {});
}

/** @param {Edits} table @param {string[]} path @param {unknown} value */
function put(table, [key, ...rest], value) {
  if (rest.length) {
    table[key] ??= {};
    put(table[key], rest, value);
    if (!Object.keys(table[key]).length) delete table[key];
  } else if (value === null) delete table[key];
  else table[key] = value;
}

/** Corrections with some fields changed, as a new table; null takes a field away. @param {Edits} edits @param {Fields} fields */
export function withFields(edits, fields) {
  const table = structuredClone(edits ?? {});
  for (const [path, value] of Object.entries(fields)) put(table, path.split("."), value);
  return table;
}

/** The value of a field that a page has now, and the layer that gives it: "rule 41", "page"; "" for none. @param {{sources: Source[]}} found @param {string} path @returns {[any, string]} */
export function present(found, path) {
  const giving = found.sources.filter(({ edits }) => valueAt(edits, path) !== undefined).at(-1);
  return giving ? [valueAt(giving.edits, path), giving.source] : [undefined, ""];
}

/** The layer that a value comes from, in the reader's language; "" for one that was found. @param {string} source */
export function sourceText(source) {
  const [kind, id] = source.split(" ");
  return kind === "rule" ? t("source.rule", { n: id }) : source && t(`source.${kind}`);
}

/** The name of a field in the reader's language, with the leaf that it is of. @param {string} path */
export function fieldText(path) {
  const [, part] = path.match(/^(?:parts\.)?(left|right)\./) ?? [];
  const name = t(`field.${nameOf(path)}`);
  return part ? `${name} (${t(`side.${part}`)})` : name;
}

/** The value of a field in the reader's language; undefined, null: as found, or as the preset has it. @param {string} path @param {any} value */
export function valueText(path, value) {
  const name = nameOf(path);
  if (value !== undefined && value !== null) return TEXTS[name](value);
  return t(OF_PRESET.has(name) ? "field.preset" : "field.none");
}

/** Whether a field fits the scan that it was made on only. @param {string} path */
export function isOfOneScan(path) {
  return OF_ONE_SCAN.has(nameOf(path));
}

// The leaves of an opened book: one scan, two pages.

import { segmented } from "../dom.js";
import { t } from "../strings.js";

/** What comes before the names of the layers of a part of a page. @param {Row} row @param {string} part */
function prefixOf(row, part) {
  return row.parts?.length > 1 ? `${part}.` : "";
}

/** The pictures that stand for a page: [{event, layer}], both leaves of an opened book, the scanner's own before. @param {Row} row */
export function pictureLayers(row) {
  if (!row.restore || row.failed) return [{ event: row.capture, layer: "original" }];
  return (row.parts ?? [{ part: "page" }]).map(({ part }) => ({ event: row.restore, layer: `${prefixOf(row, part)}page` }));
}

/** The choice between the leaves of a page: `changed` is called when another is chosen. @param {() => unknown} changed */
export function leafChoice(changed) {
  let chosen = "left";
  const choice = segmented(t("leaf"), [["left", t("side.left")], ["right", t("side.right")]], (part) => { chosen = part; changed(); });
  return { element: choice.element,
    /** Show that leaf where the page has it; "": the one that is chosen. @param {string} part */
    choose(part) { chosen = part || chosen; },
    /** The leaf that is shown, of the details of a page. @param {Details} found */
    of(found) {
      const leaves = found?.leaves ?? [];
      choice.element.hidden = leaves.length < 2;
      choice.show(chosen);
      return leaves.find(({ part }) => part === chosen) ?? leaves[0] ?? null;
    } };
}

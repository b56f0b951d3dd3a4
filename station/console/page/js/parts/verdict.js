// The lights of a page's verdict: each measure on its scale, with the limits of amber and red.

import { button, h, icon, set } from "../dom.js";
import { faultText } from "../faults.js";
import { measure } from "../format.js";
import { firstOf, t } from "../strings.js";
import { leafName, sameFinding, seeBoth } from "./both.js";
import { levelIcon } from "./strip.js";

const LENGTH = 100; // of a scale, in its own units
const [GREEN, AMBER] = [50, 80]; // where amber and red begin: every scale alike, so that the eye compares places

/** Where on a scale of 0 to LENGTH a value stands between its limits; less is worse where the first limit is greater. @param {number} value @param {number[]} pair */
export function place(value, [amber, red]) {
  const past = (value - amber) / (red - amber);
  if (past >= 0) return Math.min(GREEN + past * (AMBER - GREEN), LENGTH);
  // Green is drawn from the best value, one for a share that should be large and zero for what should be small.
  const best = amber > red ? (amber <= 1 ? 1 : amber * 2) : 0;
  return best === amber ? 0 : Math.max(0, GREEN * (1 - (value - amber) / (best - amber)));
}

/** @param {Finding} finding */
function scale({ value, limits, level }) {
  const band = (/** @type {number} */ from, /** @type {number} */ to, /** @type {string} */ name) => h("rect", { x: from, y: 5, width: to - from, height: 4, class: `band ${name}` });
  const marks = limits && value !== null
    ? [band(0, GREEN, "green"), band(GREEN, AMBER, "amber"), band(AMBER, LENGTH, "red"),
      h("rect", { class: "needle", "data-level": level, x: Math.min(place(value, limits), LENGTH - 3), y: 0, width: 3, height: 14, rx: 1.5 })]
    : [];
  return h("svg", { class: "scale", viewBox: `0 0 ${LENGTH} 14`, preserveAspectRatio: "none", "aria-hidden": "true" }, marks);
}

/** Both limits in words: `amber above 1.2 px, red above 2 px`. @param {Finding} finding */
export function limitsText({ limits, unit, less_is_worse: less }) {
  if (!limits) return t("limits.none");
  const [amber, red] = limits.map((limit) => measure(limit, unit));
  return t(less ? "limits.below" : "limits.above", { amber, red });
}

/** The name of a measure in the reader's language. @param {string} name */
export function measureName(name) {
  return t(`measure.${name}`);
}

/** The page that a finding names, with what can be done about it. @param {Finding} finding @param {boolean} isKept */
function likeness({ level, same_as: other }, isKept) {
  if (!other || (level === "green" && !isKept)) return null;
  return h("span", { class: "light-hint" }, t(isKept ? "same.kept" : "same.as", { page: leafName(other) }),
    button(t("action.both"), { key: "b", kind: "quiet", click: seeBoth }));
}

/** @param {Finding} found @param {Row} row */
function line(found, row) {
  const isKept = Boolean(row.kept?.includes(found.same_as));
  const finding = isKept ? { ...found, level: "green" } : found;
  const text = measure(finding.value, finding.unit);
  const bad = finding.level === "amber" || finding.level === "red";
  const hint = bad ? firstOf([`hint.${finding.name}`], finding.hint) : "";
  return h("li", { class: "light", "data-level": finding.level },
    h("span", { class: "light-level" }, icon(levelIcon(finding.level)), h("span", { class: "unseen", text: `${t(`level.${finding.level}`)}:` })),
    h("span", { class: "light-name", text: [measureName(finding.name), finding.part && t(`side.${finding.part}`)].filter(Boolean).join(" · ") }), scale(finding),
    h("span", { class: "light-value", text }), h("span", { class: "unseen", text: limitsText(finding) }),
    hint ? h("span", { class: "light-hint", text: `${hint} ${limitsText(finding)}` }) : null, likeness(found, isKept));
}

/** The sign of a verdict: its level in shape, colour and word. @param {Row} row */
export function levelSign(row) {
  const level = row?.failed ? "red" : row?.level ?? "";
  const word = row?.failed ? t("level.failed") : row?.busy ? t("page.restoring") : level ? t(`level.${level}`) : t("level.none");
  return h("strong", { class: "sign", "data-level": level }, icon(levelIcon(level)), h("span", { text: word }));
}

/** The lights of a page; `show` takes its row and, when they are known, its findings and notes. */
export function verdictLights() {
  const list = h("ul", { class: "lights", "aria-label": t("verdict") });
  const status = h("p", { class: "soft" });
  const noted = h("div", { class: "notes" });
  const element = h("div", { class: "verdict", tabindex: "0", role: "group", "aria-label": t("verdict") }, status, list, noted);
  return { element, show: (/** @type {Row} */ row, /** @type {Finding[]} */ findings, /** @type {Details["notes"]} */ notes = null) => {
    const text = !row || row.failed ? "" : row.busy ? t("verdict.waiting") : findings?.length ? "" : t("verdict.none");
    status.replaceChildren(...(row?.failed ? faultText(row.failed, "page.failed.text") : [text]));
    set(status, "hidden", !text && !row?.failed);
    set(list, "hidden", !findings?.length || Boolean(row?.failed) || null);
    const same = sameFinding(row, findings); // of both leaves of an opening
    list.replaceChildren(...(findings ?? []).filter((one) => one.name !== "similarity" || one === same).map((one) => line(one, row)));
    noted.replaceChildren(...(notes ?? []).map(({ name, text }) => h("p", { class: "soft", text: firstOf([`note.${name}`], text) })));
  } };
}

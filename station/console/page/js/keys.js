// The operator's keys and the foot-switch, which types a blank.

import { h, set } from "./dom.js";
import { openDialog } from "./dialog.js";
import { actions } from "./actions.js";
import { t } from "./strings.js";

/** @type {Record<string, string>} */ const KEYS = { " ": "capture", Enter: "accept", r: "again", u: "undo", U: "redo", m: "mark", n: "note", i: "insert", p: "preview", b: "both" };
const SCREENS = new Set(["capture", "page", "review"]); // elsewhere a key is for the fields
const STEPS = new Set(["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"]); // held, they go on
const OFF = "planish-keys-off";
/** @type {(key: string, event: KeyboardEvent) => unknown} */ let toolKey = null;

/** Let an open tool act on keys before all others: `act(key, event)` returns whether it did; null: no tool. @param {(key: string, event: KeyboardEvent) => unknown} act */
export function setToolKey(act) {
  toolKey = act;
}

/** Act on keys outside of fields and dialogs. Single letters can be switched off (WCAG 2.1.4). */
export function listenForKeys() {
  addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey || document.querySelector("dialog[open]")) return undefined;
    const target = /** @type {Element} */ (event.target);
    if (target.closest("input, textarea, select, [contenteditable], [data-own-keys]")) return undefined;
    const pressed = target.closest("button:not(.handle), a, summary") && (event.key === " " || event.key === "Enter");
    if (pressed || !SCREENS.has(document.getElementById("main").dataset.screen)) return undefined;
    if (localStorage.getItem(OFF) && event.key !== " ") return undefined;
    if ((!event.repeat || STEPS.has(event.key)) && toolKey?.(event.key, event)) return event.preventDefault();
    if (event.repeat) return undefined;
    if (event.key === "?") showKeys();
    else if (event.key === "g") location.hash = "#/sheet";
    else if (KEYS[event.key]) actions[KEYS[event.key]]();
    else return undefined;
    return event.preventDefault();
  });
}

/** @type {Record<string, string>} */ const REVIEW = { "d ␣ →": "next", "a ←": "back", s: "questionable", w: "earlier", e: "accept", x: "reject", "m q": "mark", "+ − 0": "zoom" };

/** The list of the keys, and the switch that turns them off. */
export function showKeys() {
  const off = h("input", { type: "checkbox", id: "keys-off", on: { change: () => {
    if (off.checked) localStorage.setItem(OFF, "1");
    else localStorage.removeItem(OFF);
  } } });
  off.checked = localStorage.getItem(OFF) !== null;
  /** @type {Record<string, string>} */ const shown = { " ": t("keys.space"), Enter: "↵" };
  const rows = Object.entries(KEYS).map(([key, name]) =>
    h("div", { class: "key-row" }, h("dt", {}, h("kbd", { text: shown[key] ?? key })), h("dd", { text: t(`action.${name}`) })));
  const sheet = h("div", { class: "key-row" }, h("dt", {}, h("kbd", { text: "g" })), h("dd", { text: t("screen.sheet") }));
  const help = h("div", { class: "key-row" }, h("dt", {}, h("kbd", { text: "?" })), h("dd", { text: t("keys.title") }));
  const review = Object.entries(REVIEW).map(([key, name]) =>
    h("div", { class: "key-row" }, h("dt", {}, h("kbd", { text: key })), h("dd", { text: `${t("screen.review")}: ${t(`review.${name}`)}` })));
  const list = h("dl", { class: "keys" }, rows, sheet, help, review);
  set(list, "aria-label", t("keys.title"));
  openDialog(t("keys.title"), [h("p", { class: "soft", text: t("keys.text") }), list,
    h("label", { class: "check", for: "keys-off" }, off, h("span", { text: t("keys.off") }))]);
}

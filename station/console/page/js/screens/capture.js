// The shoot screen: what the scanner sees, the page that was shot last, its lights and what can be done.

import { actionButton, actionPad } from "../actions.js";
import { keyed } from "../api.js";
import { h, icon, placeholder, segmented, set, setText } from "../dom.js";
import { pageName, percent, time } from "../format.js";
import { details } from "../parts/details.js";
import { pictureLayers } from "../parts/leaves.js";
import { previewPane } from "../parts/preview.js";
import { pageStrip } from "../parts/strip.js";
import { levelSign, verdictLights } from "../parts/verdict.js";
import { current, on, store } from "../store.js";
import { firstOf, t } from "../strings.js";

const LIMIT = /^at most (\d+) s$/; // the step that shows how much of its time a shot has taken

/** The picture of a page in the space there is, and the way to look at it closely. */
function pagePane() {
  const element = h("div", { class: "shot" });
  const waiting = h("p", { class: "shot-waiting", hidden: true }, icon("refresh-cw"), h("span"));
  let drawn = "";
  const show = (/** @type {Row} */ row) => {
    waiting.hidden = !row?.busy;
    if (row) setText(waiting.lastChild, t("shot.restoring", { page: pageName(row) }));
    const key = row ? `${row.page} ${row.capture} ${row.restore} ${row.failed}` : "";
    if (key === drawn && element.firstChild) return;
    drawn = key;
    if (!row) {
      element.replaceChildren(placeholder("first-page", t("capture.first"), t("capture.first.text")));
      return;
    }
    const name = t(row.restore && !row.failed ? "shot.flat" : "shot.original", { page: pageName(row) });
    element.replaceChildren(h("a", { class: "shot-link", href: `#/page/${row.page}` }, pictureLayers(row).map(({ event, layer }, at) =>
      h("img", { src: keyed(`/api/pictures/${event}/${layer}/full`), alt: at ? "" : name }))), waiting);
  };
  return { element, show };
}

function progress() {
  const bar = h("progress", { max: 1, "aria-label": t("shot.progress") });
  const words = h("span");
  const element = h("div", { class: "shot-progress", hidden: true }, words, bar);
  return { element, show: (/** @type {State["scanner"]} */ scanner) => {
    element.hidden = !scanner.busy;
    if (!scanner.busy) return;
    const [, limit] = scanner.step?.match(LIMIT) ?? [];
    const step = limit ? t("scan.limit", { s: limit }) : scanner.step ? firstOf([`scan.${scanner.step}`], scanner.step) : "";
    setText(words, [t(`scanner.${scanner.busy}`), step, scanner.done === null ? "" : percent(scanner.done)].filter(Boolean).join(" · "));
    if (scanner.done === null) bar.removeAttribute("value");
    else bar.value = scanner.done;
  } };
}

/** The screen, made once. */
export default function shootScreen() {
  const [preview, page, steps, lights] = [previewPane(), pagePane(), progress(), verdictLights()];
  const title = h("h1", { class: "page-title" });
  const sub = h("p", { class: "soft page-sub" });
  const sign = h("div", { class: "sign-place" });
  let view = "page";
  /** @type {number} */ let checked = null;
  const views = segmented(t("view"), [["page", t("view.page"), "image"], ["preview", t("view.preview"), "eye"]], (key) => showView(key));
  const showView = (/** @type {string} */ key) => {
    view = key;
    views.show(key);
    page.element.hidden = key !== "page";
    preview.element.hidden = key !== "preview";
  };
  const update = async () => {
    const row = current();
    setText(title, row ? pageName(row) : t("capture.none"));
    setText(sub, row ? facts(row) : t("capture.none.text"));
    sign.replaceChildren(row ? levelSign(row) : "");
    page.show(row);
    // While its findings are fetched a page has none: those of the page before would be taken for its own.
    if (checked !== row?.page) lights.show(null, null);
    checked = row?.page;
    if (!row) return;
    const found = row.level || row.failed ? await details(row) : null;
    if (current()?.page === row.page) lights.show(row, found?.checks, found?.notes);
  };
  for (const event of /** @type {(keyof StoreEvents)[]} */ (["rows", "row", "selected"])) on(event, update);
  on("state", (state) => { steps.show(state.scanner); if (title.textContent === "") update(); });
  on("preview", (found) => { preview.show(found); if (found && store.state?.scanner.busy !== "capture") showView("preview"); });
  on("message", (message) => { if (message.key === "stored" || message.key === "verdict") showView("page"); });
  const shoot = actionButton("capture", "capture");
  on("state", (state) => set(shoot, "data-busy", state.scanner.busy));
  showView(view);
  preview.show(store.preview);
  if (store.state) steps.show(store.state.scanner);
  update();
  return { element: h("div", { class: "screen capture-screen" },
    h("section", { class: "viewer", "aria-label": t("picture") },
      h("div", { class: "viewer-head" }, views.element, steps.element), page.element, preview.element),
    h("section", { class: "panel", "aria-label": t("page") },
      h("div", { class: "panel-head" }, h("div", {}, title, sub), sign),
      lights.element,
      actionPad(["accept", "again", "mark", "note", "insert"]), shoot),
    pageStrip()) };
}

/** The facts of a page in one line: its side, when it was shot, its state, its note. @param {Row} row */
export function facts(row) {
  return [row.side && t(`side.${row.side}`), time(row.captured), row.accepted && t("state.accepted"), row.marked && t("state.marked"),
    row.note && `“${row.note}”`].filter(Boolean).join(" · ");
}

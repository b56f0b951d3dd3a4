// Lines above the screen that say what is wrong and what to do; and the live region that speaks what happens.

import { button, h, icon, set, setText } from "./dom.js";
import { faultText } from "./faults.js";
import { number, pageName, time } from "./format.js";
import { on, store, takeControl } from "./store.js";
import { tabId } from "./api.js";
import { known, t } from "./strings.js";

const LEVEL = /: (GREEN|AMBER|RED)\b/; // in the line of a verdict
const GAP = /^between (.+) and (.+)$/;
const MANY = 2; // notices that every window has room for
const REFUSAL_MS = 12_000; // long enough to read two sentences twice

/** @param {string} level @param {string} picture @param {string} title @param {string | Fault} text @param {Content} [action] */
function notice(level, picture, title, text, action) {
  return h("div", { class: "notice", "data-level": level }, icon(picture),
    h("p", {}, h("strong", { text: title }), " ", typeof text === "object" ? faultText(text) : h("span", { text })), action ?? null);
}

/** The message of an error in the reader's language, else as the server has it. @param {import("./api.js").ApiError} error */
export function errorText(error) {
  return known(`error.${error.key}`) ? t(`error.${error.key}`, { ...error.data, text: error.text }) : `${error.text} ${error.hint}`.trim();
}

/** The operator's line of an event, in the reader's language. @param {Message} message */
export function messageText(message) {
  const page = message.page === null ? "" : pageName(store.rows.get(message.page) ?? { page: message.page });
  const [, found] = message.text.match(LEVEL) ?? [];
  const level = found ? t(`level.${found.toLowerCase()}`) : "";
  const key = `message.${message.key}`;
  return known(key) ? t(key, { page, level }) : message.text;
}

/** The board: standing notices follow the state, refusals go by themselves. */
export function noticeBoard() {
  const standing = h("div", { role: "status" });
  const passing = h("div", { role: "alert" });
  const spoken = h("p", { class: "unseen", "aria-live": "polite" });
  const board = h("section", { class: "notices", "aria-label": t("notices") }, standing, passing, spoken);
  /** @type {number} */ let timer;
  let drawn = "";
  const update = () => {
    const found = [...wanted()];
    const shown = JSON.stringify(found.map((one) => one.slice(0, 4)));
    if (shown !== drawn) standing.replaceChildren(...found.map((one) => notice(...one)));
    drawn = shown;
    set(board, "tabindex", found.length > MANY ? 0 : null); // the keyboard scrolls what does not fit
  };
  on("state", update);
  on("online", update);
  on("message", (message) => setText(spoken, messageText(message)));
  const pass = (/** @type {Parameters<typeof notice>} */ ...shown) => {
    clearTimeout(timer);
    passing.replaceChildren(notice(...shown));
    timer = setTimeout(() => passing.replaceChildren(), REFUSAL_MS);
  };
  on("refused", (error) => pass("amber", "triangle-alert", t("refused"), errorText(error)));
  on("back", (silent) => pass("green", "circle-check", t("back.title"), backText(silent)));
  return board;
}

/** What became of the station while it was not heard. @param {number} silent */
function backText(silent) {
  const { scanner, session } = store.state;
  const stored = session ? t("back.pages", { n: number(session.pages) }) : "";
  return [t("back.text", { s: number(silent / 1000) }), scanner.laser && `${t(`laser.${scanner.laser}`)}.`, stored].filter(Boolean).join(" ");
}

/** A gap in the labels of the pages, which the server names as `between 12 and 15`. @param {string} text */
function gap(text) {
  const [, one, two] = text.match(GAP) ?? [];
  return two ? t("missing.between", { one, two }) : text;
}

/** @returns {Generator<Parameters<typeof notice>>} */
function* wanted() {
  const { state, online } = store;
  if (!online) yield ["red", "wifi-off", t("offline.title"), t("offline.text")];
  if (!state) return;
  if (state.control.tab && state.control.tab !== tabId()) {
    yield ["amber", "lock", t("watching.title"),
      t("watching.text", { agent: state.control.agent || t("watching.other"), since: time(state.control.since) }),
      button(t("watching.take"), { icon: "hand", click: takeControl })];
  }
  if (state.session?.read_only) yield ["amber", "lock", t("held.title"), t("held.text", { who: state.session.held_by ?? "" })];
  if (state.failed) yield ["red", "octagon-alert", t("failed.title"), state.failed];
  if (state.scanner.laser === "unknown") yield ["red", "zap", t("laser.title"), t("laser.text")];
  if (state.scanner.problem) yield ["amber", "unplug", t("scanner.said"), state.scanner.problem];
  if (state.session?.missing?.length) yield ["amber", "info", t("missing.title"), state.session.missing.map(gap).join(", ")];
}

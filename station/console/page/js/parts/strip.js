// The strip of pages: only those in sight are elements, so that a thousand scroll as smoothly as ten.

import { keyed } from "../api.js";
import { h, icon, segmented, set, setIcon, setText } from "../dom.js";
import { number, pageName, time } from "../format.js";
import { messageText } from "../notices.js";
import { pictureLayers } from "./leaves.js";
import { current, on, select, sortRows, store } from "../store.js";
import { t } from "../strings.js";

const WIDTH = 116; // px from one page to the next, as the style sheet has it
const SPARE = 3; // pages next to those in sight, drawn before they come into it
/** @type {Record<string, string>} */ const LEVELS = { green: "circle-check", amber: "triangle-alert", red: "octagon-alert", "": "circle-help" };

/** The icon of a level: each has its own shape, for eyes that do not distinguish the colours. @param {string} level */
export function levelIcon(level) {
  return LEVELS[level] ?? LEVELS[""];
}

function card() {
  const pictures = h("span", { class: "card-picture" });
  const label = h("span", { class: "card-label" });
  const level = icon("circle-help");
  const mark = icon("bookmark");
  const done = icon("check");
  /** @type {HTMLElement} */ const element = h("div", { class: "card", role: "option", on: { click: () => select(Number(element.dataset.page)) } },
    pictures, h("span", { class: "card-foot" }, label, mark, done, level));
  return { element, show: (/** @type {Row} */ row, /** @type {number} */ at, /** @type {boolean} */ chosen) => {
    element.dataset.page = String(row.page);
    element.id = `strip-${row.page}`;
    element.style.transform = `translateX(${at * WIDTH}px)`;
    set(element, "aria-selected", String(chosen));
    set(element, "aria-setsize", store.order.length);
    set(element, "aria-posinset", at + 1);
    set(element, "aria-label", spoken(row));
    set(element, "data-level", row.level);
    set(element, "data-busy", row.busy);
    setText(label, row.label || row.page);
    setIcon(level, levelIcon(row.failed ? "red" : row.level));
    mark.classList.toggle("gone", !row.marked);
    done.classList.toggle("gone", !row.accepted);
    const sources = pictureLayers(row).map(({ event, layer }) => keyed(`/api/pictures/${event}/${layer}/thumbnail.jpg`));
    if (pictures.dataset.sources === sources.join()) return;
    pictures.dataset.sources = sources.join();
    pictures.replaceChildren(...sources.map(thumbnail));
  } };
}

/** @param {string} source */
function thumbnail(source) {
  /** @type {HTMLElement} */ const picture = h("img", { src: source, alt: "", width: 104, height: 64, loading: "lazy", decoding: "async", on: { error: () => picture.classList.add("gone") } });
  return picture;
}

/** @param {Row} row */
function spoken(row) {
  const parts = [pageName(row), row.busy ? t("page.restoring") : row.level ? t(`level.${row.level}`) : t("level.none")];
  if (row.accepted) parts.push(t("state.accepted"));
  if (row.marked) parts.push(t("state.marked"));
  return parts.join(", ");
}

function lastLine() {
  const [clock, words] = [h("time"), h("span")];
  const element = h("p", { class: "last-line", "aria-hidden": "true" }, clock, words); // the board of notices speaks it
  const update = () => {
    const [message] = store.messages;
    if (!message) return;
    setText(clock, time(message.at));
    setText(words, messageText(message));
  };
  on("message", update);
  update();
  return element;
}

/** A strip; it follows the pages by itself. */
export function pageStrip() {
  const sizer = h("div", { class: "strip-sizer", role: "listbox", tabindex: "0", "aria-label": t("strip"), "aria-orientation": "horizontal" });
  const scroller = h("div", { class: "strip-scroller" }, sizer);
  const count = h("span", { class: "soft" });
  const order = segmented(t("strip.order"), [["order", t("strip.volume"), "list-ordered"], ["worst", t("strip.worst"), "arrow-down-wide-narrow"]],
    (key) => sortRows(key === "worst"));
  const element = h("section", { class: "strip", "aria-label": t("strip") },
    h("div", { class: "strip-head" }, h("h2", { text: t("strip") }), count, lastLine(), order.element), scroller);
  /** @type {ReturnType<typeof card>[]} */ const cards = [];
  let waiting = 0;
  const draw = () => {
    waiting = 0;
    const first = Math.max(Math.floor(scroller.scrollLeft / WIDTH) - SPARE, 0);
    const last = Math.min(Math.ceil((scroller.scrollLeft + scroller.clientWidth) / WIDTH) + SPARE, store.order.length);
    while (cards.length < last - first) sizer.append(cards[cards.push(card()) - 1].element);
    const chosen = current()?.page;
    // A page keeps its element while the strip moves: the remainder of its place decides.
    const used = new Set();
    for (let at = first; at < last; at += 1) {
      const one = cards[at % cards.length];
      used.add(one);
      one.element.hidden = false;
      one.show(store.rows.get(store.order[at]), at, store.order[at] === chosen);
    }
    for (const one of cards) if (!used.has(one)) one.element.hidden = true;
    set(sizer, "aria-activedescendant", used.size && document.getElementById(`strip-${chosen}`) ? `strip-${chosen}` : null);
  };
  const later = () => { if (!waiting) waiting = requestAnimationFrame(draw); };
  const reveal = () => {
    const at = store.order.indexOf(current()?.page);
    if (at < 0) return;
    const [left, right] = [at * WIDTH, (at + 1) * WIDTH];
    if (left < scroller.scrollLeft) scroller.scrollLeft = left;
    else if (right > scroller.scrollLeft + scroller.clientWidth) scroller.scrollLeft = right - scroller.clientWidth;
  };
  const all = () => {
    sizer.style.width = `${store.order.length * WIDTH}px`;
    setText(count, number(store.order.length));
    order.show(store.worstFirst ? "worst" : "order");
    element.dataset.empty = String(store.order.length === 0);
    reveal();
    later();
  };
  sizer.addEventListener("keydown", (event) => {
    const steps = /** @type {Record<string, number>} */ ({ ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity })[event.key];
    if (!steps || !store.order.length) return;
    event.preventDefault();
    const at = store.order.indexOf(current()?.page) + steps;
    select(store.order[Math.min(Math.max(at, 0), store.order.length - 1)]);
  });
  scroller.addEventListener("scroll", later, { passive: true });
  new ResizeObserver(() => { reveal(); later(); }).observe(scroller);
  on("rows", all);
  on("row", later);
  on("state", all);
  on("selected", () => { reveal(); later(); });
  all();
  return element;
}

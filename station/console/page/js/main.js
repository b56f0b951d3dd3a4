// Start of the console: the frame around the screens, and which of them is shown.

import { claimTab, takeEntry } from "./api.js";
import { h, icon, set } from "./dom.js";
import { listenForKeys, showKeys } from "./keys.js";
import { noticeBoard } from "./notices.js";
import { statusBar } from "./status.js";
import { follow, on, store } from "./store.js";
import { chooseLanguage, language, loadStrings, t } from "./strings.js";

const SCREENS = [["capture", "camera"], ["page", "scan-eye"], ["sheet", "layers"], ["review", "search"], ["sessions", "library-big"], ["settings", "settings-2"],
  ["batch", "list-checks"], ["export", "package-check"]];
const OF_A_SESSION = new Set(["capture", "page", "sheet", "review", "settings"]);
const shown = new Map(); // screens made so far
/** @type {HTMLElement} */ let main;
/** @type {Map<string, HTMLElement>} */ let links;

function theme(name = localStorage.getItem("planish-theme") ?? "dark") {
  document.documentElement.dataset.theme = name;
  localStorage.setItem("planish-theme", name);
}

function tools() {
  const round = (/** @type {string} */ label, /** @type {string} */ name, /** @type {() => unknown} */ click) =>
    h("button", { class: "button quiet square", type: "button", "aria-label": label, title: label, on: { click } }, icon(name));
  const other = language() === "de" ? "en" : "de";
  return h("div", { class: "tools" },
    h("button", { class: "button quiet square", type: "button", lang: other, "aria-label": `${other.toUpperCase()}: ${t(`language.${other}`)}`,
      title: t(`language.${other}`), text: other.toUpperCase(),
      on: { click: () => { chooseLanguage(other); location.reload(); } } }),
    round(t("theme"), "sun", () => theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark")),
    round(t("keys.title"), "keyboard", showKeys));
}

function frame() {
  links = new Map(SCREENS.map(([name, picture]) => [name,
    h("a", { class: "rail-link", href: `#/${name}` }, icon(picture), h("span", { text: t(`screen.${name}`) }))]));
  main = h("main", { id: "main", tabindex: "-1" });
  document.getElementById("app").replaceChildren(
    h("a", { class: "skip", href: "#main", text: t("skip"), on: { click: (event) => { event.preventDefault(); main.focus(); } } }),
    h("header", { class: "top" }, statusBar(), tools()),
    h("nav", { class: "rail", "aria-label": t("screens") }, [...links.values()]),
    h("div", { class: "stage" }, noticeBoard(), main));
}

/** The name of the screen and its argument out of the address. */
function address() {
  const [name, argument] = location.hash.replace(/^#\//, "").split("/");
  const wanted = SCREENS.some(([one]) => one === name) ? name : "capture";
  return store.state && !store.state.session && OF_A_SESSION.has(wanted) ? ["sessions", ""] : [wanted, argument];
}

async function route() {
  const [name, argument] = address();
  for (const [one, link] of links) set(link, "aria-current", one === name ? "page" : null);
  document.title = `${t(`screen.${name}`)} · Planish`;
  const { default: make } = await import(`./screens/${name}.js`);
  if (!shown.has(name)) shown.set(name, make()); // two routes may have waited for it
  if (address()[0] !== name) return; // another one was asked for meanwhile
  const screen = shown.get(name);
  if (main.firstChild !== screen.element) {
    shown.get(main.dataset.screen)?.leave?.();
    main.dataset.screen = name;
    main.replaceChildren(screen.element);
  }
  screen.enter?.(argument);
}

function noEntry() {
  main.replaceChildren(h("section", { class: "placeholder" },
    h("img", { src: "/page/pictures/locked.svg", alt: "", width: 168, height: 126 }),
    h("h1", { text: t("entry.title") }), h("p", { text: t("entry.text") })));
}

theme();
takeEntry();
await Promise.all([loadStrings(), claimTab()]);
frame();
await follow();
if (store.entered) await route();
else noEntry();
addEventListener("hashchange", async () => {
  await route();
  (/** @type {HTMLElement} */ (main.querySelector("[data-first]")) ?? main).focus({ preventScroll: true }); // on a link the space bar would open the screen again, and not shoot
});
let session = store.state?.session?.name;
on("state", (state) => {
  if (state.session?.name === session) return;
  session = state.session?.name;
  route();
});
on("online", () => { if (!store.entered) noEntry(); });
listenForKeys();
performance.mark("planish-ready");
document.documentElement.dataset.ready = "true";

// The line at the top: which volume, and the state of scanner, lens, stage, laser and disk.

import { h, icon, set, setIcon, setText } from "./dom.js";
import { bytes, number } from "./format.js";
import { on, store } from "./store.js";
import { t } from "./strings.js";

const LOW_SHOTS = 50; // pages of half a shift: time to make room without haste

/** @param {string} name @param {string} picture */
function chip(name, picture) {
  const drawn = icon(picture);
  const value = h("span", { class: "chip-value" });
  const label = h("span", { class: "chip-label", text: t(`status.${name}`) });
  const element = h("li", { class: "chip", "data-chip": name }, drawn, h("span", { class: "chip-text" }, label, value));
  return {
    element,
    /** @param {string} text @param {string} [level] */
    show(text, level = "", other = picture) {
      setText(value, text);
      set(element, "data-level", level);
      set(element, "title", `${t(`status.${name}`)}: ${text}`);
      setIcon(drawn, other);
    },
  };
}

/** The elements of the line; they follow the state by themselves. */
export function statusBar() {
  const chips = { scanner: chip("scanner", "scan-line"), lens: chip("lens", "aperture"),
    stage: chip("stage", "rotate-3d"), disk: chip("disk", "hard-drive") };
  const laser = h("strong", { class: "laser", "data-laser": "off", role: "status" }, icon("zap"), h("span", { text: t("laser.off") }));
  const title = h("span", { class: "brand-session", text: t("no.session") });
  const update = () => {
    if (!store.state) return;
    setText(title, store.state.session?.title || store.state.session?.name || t("no.session"));
    showScanner(chips, store.state.scanner);
    showDisk(chips.disk, store.state.disk);
    const known = store.state.scanner.laser;
    const light = store.online ? known : "unknown";
    set(laser, "hidden", known === null || null);
    set(laser, "data-laser", light);
    setText(laser.lastChild, t(`laser.${light}`));
  };
  on("state", update);
  on("online", update);
  return [
    h("a", { class: "brand", href: "#/sessions" }, h("img", { src: "/page/pictures/planish.svg", alt: "", width: 28, height: 28 }),
      h("span", { class: "brand-text" }, h("span", { class: "brand-name", text: "Planish" }),
        title)),
    h("ul", { class: "chips", "aria-label": t("status") }, Object.values(chips).map((one) => one.element)),
    laser,
  ];
}

/** @param {Record<string, ReturnType<typeof chip>>} chips @param {State["scanner"]} scanner */
function showScanner(chips, scanner) {
  if (!store.online) chips.scanner.show(t("scanner.unknown"), "red", "unplug");
  else if (!scanner.configured) chips.scanner.show(t("scanner.none"), "", "unplug");
  else if (scanner.busy) chips.scanner.show(t(`scanner.${scanner.busy}`), "busy");
  else if (scanner.problem && !scanner.connected) chips.scanner.show(t("scanner.problem"), "red", "triangle-alert");
  else chips.scanner.show(scanner.name ?? t(scanner.connected ? "scanner.ready" : "scanner.idle"), scanner.connected ? "green" : "");
  const lens = [scanner.lens && t(`lens.${scanner.lens}`), scanner.distance_mm && `${number(scanner.distance_mm)} mm`];
  chips.lens.show(lens.filter(Boolean).join(" · ") || "–");
  chips.stage.show(scanner.stage ? scanner.stage.model : t("stage.none"));
}

/** @param {ReturnType<typeof chip>} disk @param {State["disk"]} options */
function showDisk(disk, { free_bytes: free, captures_left: shots }) {
  const low = shots !== null && shots < LOW_SHOTS;
  const text = shots === null ? t("disk.free", { free: bytes(free) })
    : t("disk.shots", { free: bytes(free), shots: number(shots) });
  disk.show(text, low ? "red" : "", low ? "triangle-alert" : "hard-drive");
}

// Settings with their ranges and units; what differs from the preset is marked, and goes back to it with one touch.

import { get, put } from "../api.js";
import { able, button, h, set, setText } from "../dom.js";
import { number } from "../format.js";
import { errorText } from "../notices.js";
import { hindrance, on } from "../store.js";
import { firstOf, known, t } from "../strings.js";

const NOTHING = ""; // of a field: the preset's value, or none

/** @param {Setting} setting */
function range({ min, max, unit }) {
  const name = unit === "fraction" ? t("unit.fraction") : unit;
  const mark = name ? ` ${name}` : "";
  if (min === null && max === null || min === undefined && max === undefined) return name ?? "";
  if (max === null || max === undefined) return t("range.from", { min: number(min, 4), unit: mark });
  if (min === null || min === undefined) return t("range.to", { max: number(max, 4), unit: mark });
  return `${number(min, 4)} – ${number(max, 4)}${mark}`;
}

/** @param {any} value @param {Setting} setting */
function shown(value, setting) {
  if (value === null || value === undefined) return t(setting.kind === "limits" ? "setting.unchecked" : "setting.auto");
  if (Array.isArray(value)) return value.map((one) => number(one, 4)).join(" / ");
  if (typeof value === "boolean") return t(value ? "yes" : "no");
  if (typeof value === "number") return `${number(value, 4)}${setting.unit ? ` ${setting.unit}` : ""}`;
  return firstOf([`choice.${value}`], String(value));
}

const numeric = (/** @type {Setting} */ setting, /** @type {string} */ id, /** @type {string} */ label = undefined) => h("input", { type: "number", id, "aria-label": label, min: setting.min, max: setting.max,
  step: setting.step ?? (setting.kind === "integer" ? 1 : "any"), inputmode: "decimal", placeholder: setting.optional ? shown(null, setting) : null });

/** @param {Setting} setting @param {string} id */
function input(setting, id) {
  if (setting.kind === "choice") {
    const choices = [...(setting.optional ? [NOTHING] : []), ...setting.choices];
    return h("select", { id }, choices.map((one) => h("option", { value: one, text: one === NOTHING ? t("setting.auto") : firstOf([`choice.${one}`], String(one)) })));
  }
  if (setting.kind === "flag") return h("input", { type: "checkbox", id });
  if (setting.kind === "limits") return h("span", { class: "limits" }, numeric(setting, id), numeric(setting, `${id}-red`, t("limits.red")));
  return numeric(setting, id);
}

/** The value of a field, null for an empty one. @param {Setting} setting @param {HTMLInputElement} element */
function fieldValue(setting, element) {
  const of = (/** @type {HTMLInputElement} */ one) => (one.value === NOTHING ? null : Number(one.value));
  if (setting.kind === "flag") return element.checked;
  if (setting.kind === "choice") return element.value === NOTHING ? null : setting.choices.find((one) => String(one) === element.value);
  if (setting.kind !== "limits") return of(element);
  const both = /** @type {HTMLInputElement[]} */ ([...element.children]).map(of);
  return both.includes(null) ? null : both;
}

/** @param {Setting} setting @param {HTMLInputElement} element @param {any} value */
function fill(setting, element, value) {
  if (setting.kind === "flag") element.checked = Boolean(value);
  else if (setting.kind === "limits") /** @type {HTMLInputElement[]} */ ([...element.children]).forEach((one, at) => { one.value = value?.[at] ?? NOTHING; });
  else element.value = value ?? NOTHING;
}

class Line {
  /** @param {Setting} setting @param {() => unknown} changed */
  constructor(setting, changed) {
    this.setting = setting;
    const id = `setting-${setting.key.replaceAll(".", "-")}`;
    this.input = /** @type {HTMLInputElement} */ (input(setting, id));
    this.reset = button("", { icon: "undo-2", kind: "square quiet", label: t("setting.reset", { name: settingName(setting) }), click: () => { fill(setting, this.input, setting.preset); changed(); } });
    this.preset = h("span", { class: "preset" });
    this.wrong = h("span", { class: "wrong", role: "alert" });
    const about = known(`about.${setting.key}`) ? t(`about.${setting.key}`) : setting.description;
    this.element = h("div", { class: "setting", "data-key": setting.key },
      h("div", { class: "setting-name" }, h("label", { for: id, text: settingName(setting) }), h("span", { class: "hint", id: `${id}-hint`, text: about })),
      h("div", { class: "setting-input" }, this.input, h("span", { class: "hint", text: range(setting) })), this.preset, this.reset, this.wrong);
    this.input.setAttribute("aria-describedby", `${id}-hint`);
    this.input.addEventListener("input", changed);
    fill(setting, this.input, setting.value);
    this.show();
  }

  get value() { return fieldValue(this.setting, this.input); }

  get staged() { return JSON.stringify(this.value) !== JSON.stringify(this.setting.value ?? null); }

  show() {
    const differs = JSON.stringify(this.value) !== JSON.stringify(this.setting.preset ?? null);
    set(this.element, "data-changed", differs || null);
    set(this.element, "data-staged", this.staged || null);
    setText(this.preset, differs ? t("setting.preset", { value: shown(this.setting.preset, this.setting) }) : "");
    set(this.reset, "hidden", !differs || null);
    setText(this.wrong, "");
  }
}

/** @param {Setting} setting */
function settingName(setting) {
  const short = setting.key.split(".").pop();
  return firstOf([`setting.${setting.key}`, `measure.${short}`], short.replaceAll("_", " "));
}

/** The screen, made once. */
export default function settingsScreen() {
  /** @type {Line[]} */ let lines = [];
  const groups = h("div", { class: "groups" });
  const status = h("p", { class: "soft", role: "status" });
  const save = button(t("setting.save"), { icon: "check", kind: "primary", click: () => send() });
  const drop = button(t("setting.drop"), { icon: "x", click: () => { for (const line of lines) { fill(line.setting, line.input, line.setting.value); } changed(); } });
  const changed = () => {
    for (const line of lines) line.show();
    const staged = lines.filter((line) => line.staged).length;
    const differ = lines.filter((line) => line.element.hasAttribute("data-changed")).length;
    setText(status, staged ? t("setting.staged", { n: staged }) : t("setting.differ", { n: differ }));
    const why = hindrance();
    able(save, why ? t(why) : staged ? "" : t("setting.same"));
    able(drop, staged ? "" : t("setting.same"));
  };
  const show = (/** @type {{groups: {key: string, settings: Setting[]}[]}} */ { groups: list }) => {
    lines = [];
    groups.replaceChildren(...list.map((/** @type {{key: string, settings: Setting[]}} */ group) => h("section", { class: "box group" }, h("h2", { text: t(`group.${group.key}`) }),
      h("p", { class: "soft", text: t(`group.${group.key}.text`) }),
      group.settings.map((/** @type {Setting} */ setting) => { const line = new Line(setting, changed); lines.push(line); return line.element; }))));
    changed();
  };
  const send = async () => {
    const staged = lines.filter((line) => line.staged);
    if (!staged.length || hindrance()) return;
    const back = (/** @type {Line} */ line) => (JSON.stringify(line.value) === JSON.stringify(line.setting.preset ?? null) ? null : line.value);
    try {
      show(await put("/api/settings", { values: Object.fromEntries(staged.map((line) => [line.setting.key, back(line)])) }));
      setText(status, t("setting.saved"));
    } catch (error) {
      const line = lines.find((one) => one.setting.key === error.data?.key);
      setText(line?.wrong ?? status, line ? error.data.text || error.text : errorText(error));
    }
  };
  const load = () => get("/api/settings").then(show).catch((error) => setText(status, errorText(error)));
  for (const event of /** @type {(keyof StoreEvents)[]} */ (["state", "online"])) on(event, changed);
  return { enter: load, element: h("div", { class: "screen plain-screen" },
    h("div", { class: "screen-head sticky" }, h("div", {}, h("h1", { text: t("screen.settings") }), status), h("div", { class: "row" }, drop, save)), groups) };
}

// Numbers, sizes and times as the reader's language writes them.

import { language, t } from "./strings.js";

const UNITS = ["B", "kB", "MB", "GB", "TB"];

/** A number with at most so many digits after the point. @param {number} value @param {number} [digits] */
export function number(value, digits = 0) {
  return new Intl.NumberFormat(language(), { maximumFractionDigits: digits }).format(value);
}

/** A fraction as a percentage; small ones keep a digit that distinguishes them from nothing. @param {number} fraction */
export function percent(fraction) {
  const digits = Math.abs(fraction) < 0.01 && fraction !== 0 ? 2 : Math.abs(fraction) < 0.1 ? 1 : 0;
  return `${number(fraction * 100, digits)} %`;
}

/** A number of bytes in decimal units. @param {number} count */
export function bytes(count) {
  const power = count < 1 ? 0 : Math.min(Math.floor(Math.log10(count) / 3), UNITS.length - 1);
  return `${number(count / 1000 ** power, power > 2 ? 1 : 0)} ${UNITS[power]}`;
}

/** A time of today as the clock shows it, another day with its date. @param {string} iso */
export function time(iso) {
  const then = new Date(iso);
  const today = then.toDateString() === new Date().toDateString();
  /** @type {Intl.DateTimeFormatOptions} */ const clock = { hour: "2-digit", minute: "2-digit", hourCycle: "h23" };
  /** @type {Intl.DateTimeFormatOptions} */ const day = { day: "numeric", month: "short", year: "numeric" };
  return new Intl.DateTimeFormat(language(), today ? { ...clock, second: "2-digit" } : { ...day, ...clock }).format(then);
}

/** A day: today, yesterday, else its date. @param {string} iso */
export function day(iso) {
  const midnight = (/** @type {Date} */ date) => new Date(date.getFullYear(), date.getMonth(), date.getDate()).getTime();
  const days = Math.round((midnight(new Date()) - midnight(new Date(iso))) / 86_400_000);
  if (days === 0 || days === 1) return t(days ? "day.yesterday" : "day.today");
  return new Intl.DateTimeFormat(language(), { dateStyle: "long" }).format(new Date(iso));
}

/** A measure of the verdict with its unit. @param {number} value @param {string} unit */
export function measure(value, unit) {
  if (value === null || value === undefined) return "–";
  if (unit === "fraction") return percent(value);
  return `${number(value, Math.abs(value) < 10 ? 2 : 0)}${unit ? ` ${unit}` : ""}`;
}

/** How the page is named for the operator: its label, else its number. @param {{page: number, label?: string}} row */
export function pageName(row) {
  if (!row) return "";
  return row.label && row.label !== String(row.page) ? t("page.name.label", { n: row.page, label: row.label }) : t("page.name", { n: row.page });
}

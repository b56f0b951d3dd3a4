// The page's words in two languages, from the one table `strings.json`.

const LANGUAGES = ["en", "de"];
const FALLBACK = "en";
/** @type {Record<string, string[]>} */ let table = {};
let column = 0;

/** Load the table; choose the language that was chosen before, else the browser's. */
export async function loadStrings() {
  table = await (await fetch("/page/strings.json")).json();
  const wanted = localStorage.getItem("planish-language") ?? navigator.language.slice(0, 2);
  column = LANGUAGES.indexOf(LANGUAGES.includes(wanted) ? wanted : FALLBACK);
  document.documentElement.lang = language();
}

/** The language that is shown: "en" or "de". */
export function language() {
  return LANGUAGES[column];
}

/** Show another language from the next start of the page on. @param {string} name */
export function chooseLanguage(name) {
  localStorage.setItem("planish-language", name);
}

/** Whether the table has a key. @param {string} key */
export function known(key) {
  return Object.hasOwn(table, key);
}

/** The text of a key, its {names} filled in; the key itself where the table lacks it. @param {string} key @param {Record<string, unknown>} [values] */
export function t(key, values = {}) {
  const text = known(key) ? table[key][column] : key;
  return text.replace(/\{(\w+)\}/g, (whole, name) => (name in values ? String(values[name]) : whole));
}

/** The text of the first key that the table has. @param {string[]} keys @param {string} [otherwise] */
export function firstOf(keys, otherwise = "") {
  const key = keys.find(known);
  return key ? t(key) : otherwise;
}

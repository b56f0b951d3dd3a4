// The details of pages, loaded when they are looked at and kept until the page changes.

import { getOrNull } from "../api.js";
import { on } from "../store.js";

/** @type {Map<number, {key: string, details: Details}>} */ const kept = new Map(); // page →
const keyOf = (/** @type {Row} */ row) => [row.capture, row.restore, row.level, row.busy, row.accepted, row.marked, row.note, row.label, row.kept].join();

/** Everything the server knows of a page, null when it is gone or cannot be reached. @param {Row} row */
export async function details(row) {
  const found = kept.get(row.page);
  if (found?.key === keyOf(row)) return found.details;
  /** @type {Details} */ const loaded = await getOrNull(`/api/pages/${row.page}`);
  if (loaded) kept.set(row.page, { key: keyOf(row), details: loaded });
  return loaded;
}

on("state", (state) => { if (!state.session) kept.clear(); });

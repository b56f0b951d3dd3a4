// The details of pages, loaded when they are looked at and kept until the page changes.

import { get } from "../api.js";
import { on } from "../store.js";

const kept = new Map(); // page → {key, details}
const keyOf = (row) => [row.capture, row.restore, row.level, row.busy, row.accepted, row.marked, row.note, row.label].join();

/** Everything the server knows of a page, null when it is gone or cannot be reached. */
export async function details(row) {
  const found = kept.get(row.page);
  if (found?.key === keyOf(row)) return found.details;
  const loaded = await get(`/api/pages/${row.page}`).catch(() => null);
  if (loaded) kept.set(row.page, { key: keyOf(row), details: loaded });
  return loaded;
}

on("state", (state) => { if (!state.session) kept.clear(); });

// The server's models: a JSON header, then arrays in little endian.

import { getBytes } from "../api.js";

const MAGIC = 0x314d4c50; // "PLM1"
/** @type {Record<string, Float32ArrayConstructor | Uint32ArrayConstructor | Uint8ArrayConstructor | Uint16ArrayConstructor>} */
const TYPES = { float32: Float32Array, uint32: Uint32Array, uint8: Uint8Array, uint16: Uint16Array };
const KEPT = 6; // models of the pages looked at last: a dense one takes ten megabytes
/** @type {Map<string, Promise<Model>>} */ const models = new Map();

/** The header and the arrays of a model's bytes: {…header, arrays: {name: {values, shape}}}. Throws on other bytes. @param {ArrayBuffer} bytes */
export function parseModel(bytes) {
  const view = new DataView(bytes);
  if (bytes.byteLength < 8 || view.getUint32(0, true) !== MAGIC) throw new Error("not a model");
  const length = view.getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 8, length)));
  /** @type {Model["arrays"]} */ const arrays = {};
  for (const [name, { type, shape, offset }] of Object.entries(/** @type {Record<string, {type: string, shape: number[], offset: number}>} */ (header.arrays))) {
    arrays[name] = { shape, values: new TYPES[type](bytes, 8 + length + offset, shape.reduce((one, two) => one * two, 1)) };
  }
  return { ...header, arrays };
}

/** A model of an event, or of a leaf of it: "scan", "mesh" or "steps"; the last few are kept. @param {number} event @param {string} kind @param {string} [prefix] */
export function loadModel(event, kind, prefix = "") {
  const path = `/api/models/${event}/${kind}${kind === "scan" ? "?faces=0" : `?leaf=${prefix}`}`;
  if (!models.has(path)) {
    const loading = getBytes(path).then(parseModel);
    loading.catch(() => models.delete(path));
    models.set(path, loading);
    if (models.size > KEPT) models.delete(models.keys().next().value);
  }
  return models.get(path);
}

// Points drawn by a z-buffer of the page's own. Where WebGL is computed in software each point costs it two
// microseconds; here it costs twenty nanoseconds, so that a whole scan of 307,200 points turns smoothly.

const FAR = 3.4e38;
const LARGEST = 5; // px of a point's side: beyond it the sheet is looked at too closely to be closed
const SAMPLED = 1000; // neighbours whose distance is measured

/** Median distance of neighbours in a list of points (n, 3): the spacing of the range grid along its rows. @param {Float32Array} vertices */
export function spacing(vertices) {
  const count = vertices.length / 3 - 1;
  const step = Math.max(Math.floor(count / SAMPLED), 1);
  /** @type {number[]} */ const found = [];
  for (let at = 0; at < count; at += step) {
    const k = 3 * at;
    found.push(Math.hypot(vertices[k + 3] - vertices[k], vertices[k + 4] - vertices[k + 1], vertices[k + 5] - vertices[k + 2]));
  }
  return found.sort((one, two) => one - two)[found.length >> 1] ?? 0;
}

/** Greatest distance of points (n, 3) from the origin. @param {Float32Array} vertices */
export function reach(vertices) {
  let square = 0;
  for (let k = 0; k < vertices.length; k += 3) square = Math.max(square, vertices[k] ** 2 + vertices[k + 1] ** 2 + vertices[k + 2] ** 2);
  return Math.sqrt(square) || 1;
}

/** A canvas with points. vertices: (n, 3) mm; colours: (n, 3) bytes. */
export class PointCloud {
  /** @param {HTMLCanvasElement} canvas @param {Float32Array} vertices @param {Numbers} colours */
  constructor(canvas, vertices, colours) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.vertices = vertices;
    this.colours = new Uint32Array(vertices.length / 3);
    for (let at = 0; at < this.colours.length; at += 1) {
      this.colours[at] = 0xff000000 | (colours[3 * at + 2] << 16) | (colours[3 * at + 1] << 8) | colours[3 * at];
    }
    this.spacing = spacing(vertices);
    this.radius = reach(vertices);
    this.frames = 0;
    /** @type {ImageData} */ this.image = undefined;
    /** @type {Uint32Array} */ this.pixels = undefined;
    /** @type {Float32Array} */ this.depths = undefined;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height || (this.image?.width === width && this.image.height === height)) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.image = new ImageData(width, height);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.depths = new Float32Array(width * height);
  }

  /** Draw as an eye sees it: {position, right, up, back, focal}; focal: of the height of the picture. @param {Eye} eye */
  draw(eye) {
    this.resize();
    if (!this.image) return;
    this.pixels.fill(0);
    this.depths.fill(FAR);
    const focal = eye.focal * this.image.height;
    const side = Math.ceil((this.spacing * focal) / Math.hypot(...eye.position)); // no gap between neighbours
    splat(this, eye, focal, Math.min(Math.max(side, 1), LARGEST));
    this.context.putImageData(this.image, 0, 0);
    this.frames += 1;
    this.canvas.dataset.frames = String(this.frames);
  }
}

/** @param {PointCloud} cloud @param {Eye} eye @param {number} focal @param {number} side */
function splat({ vertices, colours, pixels, depths, image: { width, height } }, { position: [px, py, pz], right: [rx, ry, rz], up: [ux, uy, uz], back: [bx, by, bz] }, focal, side) {
  const [middle, centre, half] = [width / 2, height / 2, (side - 1) / 2];
  for (let at = 0, k = 0; at < colours.length; at += 1, k += 3) {
    const x = vertices[k] - px, y = vertices[k + 1] - py, z = vertices[k + 2] - pz;
    const depth = -(x * bx + y * by + z * bz);
    if (depth <= 0) continue;
    const scale = focal / depth;
    const left = Math.floor(middle + (x * rx + y * ry + z * rz) * scale - half);
    const top = Math.floor(centre - (x * ux + y * uy + z * uz) * scale - half);
    if (left < 0 || top < 0 || left + side > width || top + side > height) continue;
    for (let line = top * width + left, below = line + side * width; line < below; line += width) {
      for (let pixel = line; pixel < line + side; pixel += 1) {
        if (depth < depths[pixel]) {
          depths[pixel] = depth;
          pixels[pixel] = colours[at];
        }
      }
    }
  }
}

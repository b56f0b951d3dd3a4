// What WebGL draws of a model: mesh, texture, strain, and the sheet on its way into the plane.

import * as THREE from "/page/vendor/three/three.module.js";

const SHARPEST = 1.5; // device pixels for one of the style sheet: more costs time and shows nothing
const PAPER = 0xdcd6ca;

/** The pixels of a picture as {data, width, height}. @param {HTMLImageElement} image */
export function pixelsOf(image) {
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, image.width, image.height);
}

/** The colour of a picture at every texture coordinate, (n, 3) bytes. @param {Numbers} uv @param {ImageData} image */
export function sampled(uv, { data, width, height }) {
  const colours = new Uint8Array((uv.length / 2) * 3);
  for (let at = 0; at < uv.length / 2; at += 1) {
    const x = Math.min(Math.max(Math.floor(uv[2 * at] * width), 0), width - 1);
    const y = Math.min(Math.max(Math.floor((1 - uv[2 * at + 1]) * height), 0), height - 1);
    colours.set(data.subarray((y * width + x) * 4, (y * width + x) * 4 + 3), 3 * at);
  }
  return colours;
}

/** The colours of values from −end to end on a list of colours "#rrggbb", (n, 3) bytes. @param {Float32Array} values @param {number} end @param {string[]} palette */
export function scaled(values, end, palette) {
  const stops = palette.map((name) => [1, 3, 5].map((at) => parseInt(name.slice(at, at + 2), 16)));
  const colours = new Uint8Array(values.length * 3);
  values.forEach((value, at) => {
    const place = Math.min(Math.max((value / end + 1) / 2, 0), 1) * (stops.length - 1);
    const low = Math.min(Math.floor(place), stops.length - 2);
    for (let k = 0; k < 3; k += 1) colours[3 * at + k] = stops[low][k] + (place - low) * (stops[low + 1][k] - stops[low][k]);
  });
  return colours;
}

/** Positions between two frames of an animation, (n, 3); `share` runs from 0, the first frame, to 1, the last. @param {Float32Array[]} frames @param {number} share @param {Float32Array} target */
export function between(frames, share, target) {
  const place = Math.min(Math.max(share, 0), 1) * (frames.length - 1);
  const low = Math.min(Math.floor(place), frames.length - 2);
  const [one, two, part] = [frames[low], frames[low + 1], place - low];
  for (let at = 0; at < target.length; at += 1) target[at] = one[at] + part * (two[at] - one[at]);
  return target;
}

/** A canvas with one model. Throws where the browser has no WebGL. */
export class Scene {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    THREE.ColorManagement.enabled = false; // pictures are shown with the codes they have
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: false });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.camera = new THREE.PerspectiveCamera();
    this.scene = new THREE.Scene();
    const lamp = new THREE.DirectionalLight(0xffffff, 2);
    lamp.position.set(-0.6, 0.8, 1);
    this.scene.add(lamp, new THREE.AmbientLight(0xffffff, 0.7));
    this.frames = 0;
    this.radius = 100;
  }

  /** Take away what was drawn, and free its memory. */
  clear() {
    for (const one of [...this.scene.children]) {
      if (!(one instanceof THREE.Mesh)) continue;
      this.scene.remove(one);
      one.geometry.dispose();
      one.material.map?.dispose();
      one.material.dispose();
    }
  }

  /**
   * Draw a sheet.
   * @param {Float32Array} vertices @param {Uint32Array} faces
   * @param {{uv?: Float32Array, image?: HTMLImageElement, colours?: Uint8Array, wire?: boolean}} [look]
   */
  sheet(vertices, faces, { uv, image, colours, wire } = {}) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(vertices, 3));
    geometry.setIndex(new THREE.BufferAttribute(faces, 1));
    const look = { side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    if (uv && image) {
      geometry.setAttribute("uv", new THREE.BufferAttribute(uv, 2));
      const map = new THREE.Texture(image);
      map.needsUpdate = true;
      this.put(geometry, new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ ...look, map })));
    } else if (colours) {
      geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3, true));
      this.put(geometry, new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ ...look, vertexColors: true })));
    } else {
      geometry.computeVertexNormals();
      this.put(geometry, new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ ...look, color: PAPER })));
    }
    if (wire) {
      const lines = new THREE.MeshBasicMaterial({ color: 0x1b1a18, wireframe: true, transparent: true, opacity: 0.18 });
      this.scene.add(new THREE.Mesh(geometry, lines));
    }
  }

  /** @param {THREE.BufferGeometry} geometry @param {THREE.Mesh} drawn */
  put(geometry, drawn) {
    geometry.computeBoundingSphere();
    this.radius = geometry.boundingSphere.radius || 1;
    this.drawn = drawn;
    drawn.frustumCulled = false;
    this.scene.add(drawn);
  }

  /** New positions for the sheet that is drawn. @param {Float32Array} vertices */
  bend(vertices) {
    const { position } = this.drawn.geometry.attributes;
    position.array.set(vertices);
    position.needsUpdate = true;
  }

  /** The colour around the model, as the style sheet has it. */
  surround() {
    this.scene.background = new THREE.Color(getComputedStyle(this.canvas).getPropertyValue("--wall").trim());
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, SHARPEST));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
  }

  /** Draw the model as an eye of `Orbit.eye` sees it. @param {Eye} eye */
  draw({ position, right, up, back, focal }) {
    const away = Math.hypot(...position);
    const [rightward, upward, backward] = [right, up, back].map((axis) => new THREE.Vector3().fromArray(axis));
    this.camera.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(rightward, upward, backward));
    this.camera.position.fromArray(position);
    Object.assign(this.camera, { near: away / 50, far: away + 4 * this.radius, fov: (Math.atan(0.5 / focal) * 360) / Math.PI });
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera);
    this.frames += 1;
    this.canvas.dataset.frames = String(this.frames);
  }

  end() {
    this.clear();
    this.renderer.dispose();
  }
}

// The network: one sphere per particle, and one cylinder per contact, whose radius and colour show the
// normal force. Each is a square that faces the camera; what differs between bodies is in a texture, which
// the shader reads by the number of the vertex. Drivers that compute without a graphics card draw this many
// times faster than instanced geometry.
import { BufferAttribute, BufferGeometry, DataTexture, FloatType, Mesh, RGBAFormat, Vector3 } from "three";
import { CLASS_COLOURS, COLOURS, MEDIA, PALE, STEEL, blend, mediaColour, rgb } from "./colours.js";
import { DOMINANT, QUASI_LINEAR, vector } from "./data.js";
import { bodyMaterial } from "./shading.js";

const TEXELS = 3; // per body: start and radius, end and width of a halo, colour
// Radii in mean particle radii: at the top of the scale of forces, least ones, and the width of a halo.
const LARGEST = 0.6,
  LEAST_MARKED = 0.1,
  LEAST = 0.018,
  HALO = 0.14;
const MARKED = 0.75; // least size of a particle on the path, in its radius

/** Many bodies of one shape in one draw call. */
export class Bodies {
  /** `most`: room for so many bodies; `options` of their material. */
  constructor(most, options) {
    const width = 3 * Math.min(Math.max(most, 1), 512),
      height = Math.ceil((TEXELS * Math.max(most, 1)) / width);
    this.values = new Float32Array(4 * width * height);
    this.texture = new DataTexture(this.values, width, height, RGBAFormat, FloatType);
    const corners = Uint32Array.from({ length: 6 * most }, (_, k) => 4 * Math.floor(k / 6) + [0, 1, 3, 0, 3, 2][k % 6]);
    const geometry = new BufferGeometry().setIndex(new BufferAttribute(corners, 1));
    this.mesh = new Mesh(geometry, bodyMaterial({ bodies: { value: this.texture } }, options));
    this.mesh.frustumCulled = false;
    this.clear();
  }

  /** Forget all bodies. */
  clear() {
    this.rows = []; // which particle or contact each is
  }

  get count() {
    return this.rows.length;
  }

  /** Add a body between two points of this radius; `halo`: width of the rim that is drawn behind it, or 0. */
  add(row, start, end, radius, tint, halo = 0) {
    const { values } = this,
      at = 4 * TEXELS * (this.rows.push(row) - 1);
    for (let axis = 0; axis < 3; axis++) {
      values[at + axis] = start[axis];
      values[at + 4 + axis] = end[axis];
      values[at + 8 + axis] = tint[axis];
    }
    values[at + 3] = radius;
    values[at + 7] = halo;
  }

  /** Start, end and radius of a body. */
  at(number) {
    const at = 4 * TEXELS * number;
    return [this.values.subarray(at, at + 3), this.values.subarray(at + 4, at + 7), this.values[at + 3]];
  }

  /** Draw the bodies that were added. */
  show() {
    this.mesh.geometry.setDrawRange(0, 6 * this.count);
    this.mesh.visible = this.count > 0;
    const { width } = this.texture.image;
    this.texture.clearUpdateRanges();
    for (let row = 0; row < Math.ceil((TEXELS * this.count) / width); row++)
      this.texture.addUpdateRange(4 * width * row, 4 * width);
    if (this.count) this.texture.needsUpdate = true;
  }

  /** The nearest body that a ray meets, or that it passes within `near` mm: row and distance. */
  hit({ ray }, near = 0) {
    const met = new Vector3();
    let nearest = null;
    for (const [number, row] of this.rows.entries()) {
      const [start, end, radius] = this.at(number),
        square = ray.distanceSqToSegment(new Vector3(...start), new Vector3(...end), met);
      if (square > Math.max(radius, near) ** 2) continue;
      const distance = met.distanceTo(ray.origin) - Math.sqrt(Math.max(radius ** 2 - square, 0));
      if (!(distance >= nearest?.distance)) nearest = { row, distance };
    }
    return nearest;
  }
}

export class Media {
  constructor(frames) {
    this.frames = frames;
    const { clumps = [] } = frames.head;
    this.spheres = new Bodies(frames.most.particles * Math.max(1, ...clumps.map(({ spheres }) => spheres.length)));
  }

  /** Show a frame; `look` is the state of the controls. */
  update(frame, look, colourOf) {
    const onPath = look.path ? particlesOnPath(frame) : new Set(),
      measures = { speed: () => frame.speed, displacement: () => this.frames.moved(frame) },
      measure = measures[look.colour]?.();
    const { classes } = this.frames.head.media,
      ofClass = (k) => rgb(mediaColour(classes.findLastIndex(({ first }) => first <= frame.id[k])));
    const plain = rgb(MEDIA),
      path = blend(rgb(COLOURS.dominant_path), [1, 1, 1], 0.25);
    this.spheres.clear();
    for (let k = 0; k < frame.id.length; k++) {
      const size = onPath.has(k) ? Math.max(look.size, MARKED) : look.size;
      if (size <= 0 || !look.kept[k]) continue;
      const centre = vector(frame.centre, k),
        own = look.colour === "media" ? ofClass(k) : onPath.has(k) ? path : plain,
        tint = measure ? colourOf(measure[k] / look.top) : own;
      for (const [place, radius] of this.frames.spheres(frame, k)) {
        const at = centre.map((middle, axis) => middle + size * place[axis]);
        this.spheres.add(k, at, at, size * radius, tint);
      }
    }
    this.spheres.show();
  }
}

/** The rows of the particles on the dominant path. */
function particlesOnPath({ a, b, flags, id }) {
  const contacts = [...flags.keys()].filter((k) => flags[k] & DOMINANT);
  return new Set(contacts.flatMap((k) => [a[k], b[k]]).filter((row) => row < id.length));
}

export class Contacts {
  constructor(frames) {
    this.frames = frames;
    [this.cylinders, this.halos] = [0, 1].map(() => new Bodies(frames.most.contacts));
    this.counts = [0, 0, 0]; // shown, by class
  }

  /** Show the contacts of a frame that pass threshold, classes and section. */
  update(frame, look, colourOf) {
    const { from, to } = this.frames.ends(frame),
      { scales, media } = this.frames.head,
      kinds = this.frames.classes(frame);
    const tints = CLASS_COLOURS.map(rgb),
      pale = rgb(PALE),
      steel = rgb(STEEL),
      marks = [COLOURS.dominant_path, COLOURS.chain].map(rgb);
    this.counts = [0, 0, 0];
    this.cylinders.clear();
    this.halos.clear();
    for (let k = 0; k < frame.a.length; k++) {
      const kind = kinds[k],
        part = frame.normal[k] / scales.force,
        flags = frame.flags[k];
      const onPath = look.path && (flags & DOMINANT) > 0,
        passes = look.classes[kind] && frame.normal[k] > look.threshold,
        marked = onPath || (look.chains && (flags & QUASI_LINEAR) > 0 && passes);
      if (!marked && !(passes && look.others !== "hidden")) continue;
      if (!look.kept[frame.a[k]] || look.kept[frame.b[k]] === 0) continue;
      this.counts[kind]++;
      let tint = look.colour === "force" ? colourOf(part) : look.colour === "class" ? tints[kind] : steel;
      if (look.others === "faded" && !marked) tint = blend(tint, pale, 0.8);
      const radius = media.radius * Math.min(Math.max(LARGEST * part, marked ? LEAST_MARKED : LEAST), LARGEST),
        line = [vector(from, k), vector(to, k)];
      this.cylinders.add(k, ...line, radius, tint);
      if (marked) this.halos.add(k, ...line, radius, marks[onPath ? 0 : 1], HALO * media.radius);
    }
    this.cylinders.show();
    this.halos.show();
  }
}

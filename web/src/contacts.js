// The contacts: one cylinder each, whose radius and colour show the normal force.
import { BufferAttribute, BufferGeometry } from "three";
import { CHAIN_COLOUR, CHOSEN, CLASS_COLOURS, PALE, PATH_COLOUR, STEEL, blend, rgb } from "./colours.js";
import { DOMINANT, QUASI_LINEAR } from "./frames.js";
import { Instances } from "./instances.js";
import { cylinderMaterial } from "./shading.js";

const SIDES = 8;
const LEAST_MARKED = 0.1; // radius of a contact with a halo, in mean particle radii, at least
const LEAST = 0.012; // radius of any other contact
const HALO = 0.1; // width of a halo

export class Contacts {
  constructor(frames) {
    const sizes = { from: 3, to: 3, colour: 3, radius: 1 }, most = frames.most.contacts;
    this.frames = frames;
    this.cylinders = new Instances(tube(), sizes, most, cylinderMaterial(false));
    this.halos = new Instances(tube(), sizes, most, cylinderMaterial(true));
    this.halos.mesh.material.uniforms.wider.value = HALO * frames.head.media.radius;
    this.meshes = [this.cylinders.mesh, this.halos.mesh];
    this.rows = [];
    this.counts = [0, 0, 0]; // shown, by class
  }

  /** Show the contacts of a frame that pass threshold and classes; see `media.js`. */
  update(frame, look, colourOf) {
    const { from, to } = this.frames.ends(frame), { force } = this.frames.head.scales, mean = this.frames.head.media.radius;
    const classes = CLASS_COLOURS.map(rgb), pale = rgb(PALE), steel = rgb(STEEL), marks = [PATH_COLOUR, CHAIN_COLOUR, CHOSEN].map(rgb);
    const chosen = look.chosen?.pair ? this.frames.find(frame, ...look.chosen.pair) : -1;
    this.rows = [];
    this.counts = [0, 0, 0];
    let halos = 0;
    for (let k = 0; k < frame.a.length; k++) {
      const kind = this.frames.classOf(frame, k), value = frame.normal[k], flags = frame.flags[k];
      const onPath = look.path && (flags & DOMINANT) > 0, inChain = look.chains && (flags & QUASI_LINEAR) > 0;
      const passes = look.classes[kind] && value > look.threshold;
      if (passes) this.counts[kind]++;
      const marked = k === chosen || onPath || (inChain && passes);
      if (!passes && !marked) continue;
      let tint = look.colour === "force" ? colourOf(value / force) : look.colour === "class" ? classes[kind] : steel;
      if (look.fade && !marked) tint = blend(tint, pale, 0.8);
      const radius = mean * Math.min(Math.max(value / force, marked ? LEAST_MARKED : LEAST), 1);
      put(this.cylinders.arrays, this.rows.push(k) - 1, from, to, k, tint, radius);
      if (marked) put(this.halos.arrays, halos++, from, to, k, k === chosen ? marks[2] : onPath ? marks[0] : marks[1], radius);
    }
    this.cylinders.show(this.rows.length);
    this.halos.show(halos);
  }

  /** The nearest contact that a ray meets, or that it passes within `near` mm: row and distance. */
  hit(origin, direction, near) {
    const { from, to, radius } = this.cylinders.arrays;
    let nearest = null;
    this.rows.forEach((row, at) => {
      const [apart, distance] = rayToLine(origin, direction, from, to, 3 * at);
      if (apart <= Math.max(radius[at], near) && !(nearest?.distance < distance)) nearest = { row, distance };
    });
    return nearest;
  }
}

function put(arrays, at, from, to, k, tint, radius) {
  arrays.from.set(from.subarray(3 * k, 3 * k + 3), 3 * at);
  arrays.to.set(to.subarray(3 * k, 3 * k + 3), 3 * at);
  arrays.colour.set(tint, 3 * at);
  arrays.radius[at] = radius;
}

/** An open tube about z from 0 to 1 with radius 1; x and y are the direction of its normals too. */
function tube() {
  const points = [], index = [];
  for (let k = 0; k < SIDES; k++) {
    const angle = (2 * Math.PI * k) / SIDES, next = (k + 1) % SIDES;
    for (const z of [0, 1]) points.push(Math.cos(angle), Math.sin(angle), z);
    index.push(2 * k, 2 * next, 2 * k + 1, 2 * next, 2 * next + 1, 2 * k + 1);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  geometry.setIndex(index);
  return geometry;
}

/** Smallest distance of a ray from the line between two points, and how far along the ray that is. */
function rayToLine(origin, direction, from, to, at) {
  const line = [0, 1, 2].map((axis) => to[at + axis] - from[at + axis]);
  const away = [0, 1, 2].map((axis) => from[at + axis] - origin[axis]);
  const dot = (one, other) => one[0] * other[0] + one[1] * other[1] + one[2] * other[2];
  const square = dot(line, line), mixed = dot(line, direction), rest = square - mixed * mixed;
  const free = rest > 1e-9 ? (mixed * dot(direction, away) - dot(line, away)) / rest : 0;
  const part = Math.min(Math.max(free, 0), 1);
  const point = away.map((value, axis) => value + part * line[axis]), along = dot(point, direction);
  return [Math.sqrt(Math.max(dot(point, point) - along * along, 0)), along];
}

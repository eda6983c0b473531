// The contacts: one cylinder each, whose radius and colour show the normal force.
import { Vector3 } from "three";
import { Bodies } from "./bodies.js";
import { nearest } from "./choice.js";
import { CLASS_COLOURS, COLOURS, PALE, STEEL, blend, rgb } from "./colours.js";
import { DOMINANT, QUASI_LINEAR } from "./frames.js";
import { bodyMaterial } from "./shading.js";

// Radii in mean particle radii: at the top of the scale of forces, least ones, and the width of a halo.
const LARGEST = 0.6,
  LEAST_MARKED = 0.1,
  LEAST = 0.018,
  HALO = 0.14;

export class Contacts {
  constructor(frames) {
    this.frames = frames;
    [this.cylinders, this.halos] = [0, 1].map(() => new Bodies(frames.most.contacts, bodyMaterial()));
    this.meshes = [this.cylinders.mesh, this.halos.mesh];
    this.rows = [];
    this.counts = [0, 0, 0]; // shown, by class
  }

  /** Show the contacts of a frame that pass threshold, classes and section; see `media.js`. */
  update(frame, look, colourOf) {
    const { from, to } = this.frames.ends(frame),
      { force } = this.frames.head.scales,
      mean = this.frames.head.media.radius;
    const kinds = this.frames.classes(frame),
      tints = CLASS_COLOURS.map(rgb),
      pale = rgb(PALE),
      steel = rgb(STEEL),
      marks = [COLOURS.dominant_path, COLOURS.chain].map(rgb);
    this.rows = [];
    this.counts = [0, 0, 0];
    this.cylinders.clear();
    this.halos.clear();
    for (let k = 0; k < frame.a.length; k++) {
      const kind = kinds[k],
        value = frame.normal[k],
        flags = frame.flags[k];
      const onPath = look.path && (flags & DOMINANT) > 0,
        inChain = look.chains && (flags & QUASI_LINEAR) > 0;
      const passes = look.classes[kind] && value > look.threshold;
      const marked = onPath || (inChain && passes);
      if (!marked && !(passes && look.others !== "hidden")) continue;
      if (!look.kept[frame.a[k]] || look.kept[frame.b[k]] === 0) continue;
      this.counts[kind]++;
      let tint = look.colour === "force" ? colourOf(value / force) : look.colour === "class" ? tints[kind] : steel;
      if (look.others === "faded" && !marked) tint = blend(tint, pale, 0.8);
      const radius = mean * Math.min(Math.max((LARGEST * value) / force, marked ? LEAST_MARKED : LEAST), LARGEST);
      const start = from.subarray(3 * k, 3 * k + 3),
        end = to.subarray(3 * k, 3 * k + 3);
      this.rows.push(k);
      this.cylinders.add(start, end, radius, 0, tint);
      if (marked) this.halos.add(start, end, radius, HALO * mean, marks[onPath ? 0 : 1]);
    }
    this.cylinders.show();
    this.halos.show();
  }

  /** The nearest contact that a ray meets, or that it passes within `near` mm: row and distance. */
  hit({ ray }, near) {
    const met = new Vector3();
    return nearest(this.rows, (at) => {
      const [start, end, radius] = this.cylinders.at(at),
        square = ray.distanceSqToSegment(new Vector3(...start), new Vector3(...end), met);
      return square <= Math.max(radius, near) ** 2 ? met.distanceTo(ray.origin) : undefined;
    });
  }
}

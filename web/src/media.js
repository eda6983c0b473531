// The media: one sphere per particle.
import { Sphere, Vector3 } from "three";
import { Bodies } from "./bodies.js";
import { nearest } from "./choice.js";
import { COLOURS, MEDIA, blend, rgb } from "./colours.js";
import { DOMINANT } from "./frames.js";
import { bodyMaterial } from "./shading.js";

const MARKED = 0.75; // least size of a particle on the path, in its radius

export class Media {
  constructor(frames) {
    this.frames = frames;
    this.spheres = new Bodies(frames.most.particles, bodyMaterial());
    this.mesh = this.spheres.mesh;
    this.rows = []; // which particle each sphere is
  }

  /** Show a frame; `look` is the state of the controls. */
  update(frame, look, colourOf) {
    const onPath = look.path ? particlesOnPath(frame) : new Set();
    const measure = { speed: frame.speed, displacement: look.colour === "displacement" && this.frames.moved(frame) }[
      look.colour
    ];
    const plain = rgb(MEDIA),
      path = blend(rgb(COLOURS.dominant_path), [1, 1, 1], 0.25);
    this.rows = [];
    this.spheres.clear();
    for (let k = 0; k < frame.id.length; k++) {
      const size = onPath.has(k) ? Math.max(look.size, MARKED) : look.size;
      if (size <= 0 || !look.kept[k]) continue;
      const centre = frame.centre.subarray(3 * k, 3 * k + 3);
      const tint = measure ? colourOf(measure[k] / look.top) : onPath.has(k) ? path : plain;
      this.rows.push(k);
      this.spheres.add(centre, centre, size * frame.radius[k], 0, tint);
    }
    this.spheres.show();
  }

  /** The nearest sphere that a ray meets: its particle's row and its distance. */
  hit({ ray }) {
    return nearest(this.rows, (at) => {
      const [centre, , radius] = this.spheres.at(at),
        met = ray.intersectSphere(new Sphere(new Vector3(...centre), radius), new Vector3());
      return met?.distanceTo(ray.origin);
    });
  }
}

/** The rows of the particles on the dominant path. */
export function particlesOnPath(frame) {
  const rows = new Set();
  frame.flags.forEach((flags, contact) => {
    if (!(flags & DOMINANT)) return;
    for (const row of [frame.a[contact], frame.b[contact]]) if (row < frame.id.length) rows.add(row);
  });
  return rows;
}

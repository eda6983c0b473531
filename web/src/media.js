// The media: one sphere per particle.
import { BufferAttribute, BufferGeometry } from "three";
import { CHOSEN, MEDIA, PATH_COLOUR, blend, rgb } from "./colours.js";
import { DOMINANT } from "./frames.js";
import { Instances } from "./instances.js";
import { sphereMaterial } from "./shading.js";

export class Media {
  constructor(frames) {
    const square = new BufferGeometry();
    square.setAttribute("corner", new BufferAttribute(new Float32Array([-1, -1, 1, -1, 1, 1, -1, 1]), 2));
    square.setIndex([0, 1, 2, 0, 2, 3]);
    this.frames = frames;
    this.spheres = new Instances(square, { centre: 3, colour: 3, radius: 1 }, frames.most.particles, sphereMaterial());
    this.mesh = this.spheres.mesh;
    this.rows = []; // which particle each sphere is
  }

  /** Show a frame; `look` is the state of the controls. */
  update(frame, look, colourOf) {
    const { centre, colour, radius } = this.spheres.arrays, onPath = look.path ? particlesOnPath(frame) : new Set();
    const measure = { speed: frame.speed, displacement: look.colour === "displacement" && this.frames.moved(frame) }[look.colour];
    const plain = rgb(MEDIA), path = blend(rgb(PATH_COLOUR), [1, 1, 1], 0.25), chosen = rgb(CHOSEN);
    this.rows = [];
    for (let k = 0; k < frame.id.length; k++) {
      const isChosen = look.chosen?.particle === frame.id[k], size = isChosen || onPath.has(k) ? Math.max(look.size, 0.45) : look.size;
      if (size <= 0) continue;
      const at = this.rows.push(k) - 1;
      centre.set(frame.centre.subarray(3 * k, 3 * k + 3), 3 * at);
      colour.set(isChosen ? chosen : measure ? colourOf(measure[k] / look.top) : onPath.has(k) ? path : plain, 3 * at);
      radius[at] = size * frame.radius[k];
    }
    this.spheres.show(this.rows.length);
  }

  /** The nearest sphere that a ray meets: its particle's row and its distance, or null. */
  hit(origin, direction) {
    const { centre, radius } = this.spheres.arrays;
    let nearest = null;
    this.rows.forEach((row, at) => {
      const to = [0, 1, 2].map((axis) => centre[3 * at + axis] - origin[axis]);
      const along = to[0] * direction[0] + to[1] * direction[1] + to[2] * direction[2];
      const inside = radius[at] ** 2 - (to[0] ** 2 + to[1] ** 2 + to[2] ** 2 - along ** 2);
      const distance = along - Math.sqrt(Math.max(inside, 0));
      if (inside >= 0 && distance > 0 && !(nearest?.distance < distance)) nearest = { row, distance };
    });
    return nearest;
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

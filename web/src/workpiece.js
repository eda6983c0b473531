// The workpiece: its facets, coloured by what acted on them, and an arrow along its motion.
import { BufferAttribute, BufferGeometry, ConeGeometry, CylinderGeometry, Group, Mesh } from "three";
import { COLOURS, rgb } from "./colours.js";
import { facetMaterial } from "./shading.js";

export class Workpiece {
  constructor(own, columns, top) {
    this.own = own;
    this.columns = columns;
    this.corners = columns.corners;
    this.count = this.corners.length / 9;
    this.normals = normals(this.corners);
    this.tints = new Float32Array(this.corners.length);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.corners, 3));
    geometry.setAttribute("normal", new BufferAttribute(this.normals, 3));
    geometry.setAttribute("colour", new BufferAttribute(this.tints, 3));
    this.body = new Mesh(geometry, facetMaterial());
    this.body.frustumCulled = false;
    this.group = new Group().add(this.body);
    this.arrow = arrow(own.radius);
    this.arrow.position.z = top;
  }

  /** Where the workpiece's reference point is at a frame (mm), and its turn (rad). */
  pose(number) {
    const [x, y, z, turn] = this.own.poses[number];
    return { x, y, z, turn, heading: this.own.headings[number] };
  }

  place(number) {
    const { x, y, z, turn, heading } = this.pose(number);
    this.group.position.set(x, y, z);
    this.group.rotation.set(0, 0, turn);
    this.arrow.position.set(x, y, this.arrow.position.z);
    this.arrow.rotation.set(0, 0, heading);
  }

  /** Colour the facets by a load; plain if there is none of that name. */
  update(look, colourOf) {
    const load = this.own.loads.find(({ name }) => name === look.load),
      plain = rgb(COLOURS.workpiece);
    if (this.shown === look.load) return;
    this.shown = look.load;
    this.group.visible = look.load !== "hidden";
    for (let facet = 0; facet < this.count; facet++) {
      const tint = load ? colourOf(this.columns[load.name][facet] / load.top) : plain;
      for (let corner = 0; corner < 3; corner++) this.tints.set(tint, 9 * facet + 3 * corner);
    }
    this.body.geometry.attributes.colour.needsUpdate = true;
  }

  /** The facet with the largest value of a load. */
  highest(name) {
    const values = this.columns[name];
    return values.reduce((best, value, facet) => (value > values[best] ? facet : best), 0);
  }

  /** Centre of a facet in the workpiece's own frame, its depth below the surface and its azimuth. */
  facet(number) {
    const centre = [0, 1, 2].map(
      (axis) =>
        (this.corners[9 * number + axis] + this.corners[9 * number + 3 + axis] + this.corners[9 * number + 6 + axis]) /
        3,
    );
    return { centre, depth: this.own.immersion - centre[2], azimuth: Math.atan2(centre[1], centre[0]) };
  }

  /** The nearest facet that a ray meets (Moeller and Trumbore 1997): its number and its distance, or null. */
  hit(origin, direction) {
    if (!this.group.visible) return null;
    const { x, y, z } = this.group.position,
      turn = -this.group.rotation.z;
    const start = turned([origin[0] - x, origin[1] - y, origin[2] - z], turn),
      along = turned(direction, turn);
    let nearest = null;
    for (let facet = 0; facet < this.count; facet++) {
      const distance = toFacet(this.corners, 9 * facet, start, along);
      if (distance > 0 && !(nearest?.distance < distance)) nearest = { row: facet, distance };
    }
    return nearest;
  }
}

const minus = (one, other) => one.map((value, axis) => value - other[axis]);
const dot = (one, other) => one[0] * other[0] + one[1] * other[1] + one[2] * other[2];
const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
const turned = ([x, y, z], angle) => [
  x * Math.cos(angle) - y * Math.sin(angle),
  x * Math.sin(angle) + y * Math.cos(angle),
  z,
];

function toFacet(corners, at, start, along) {
  const [first, second, third] = [0, 3, 6].map((corner) => [...corners.subarray(at + corner, at + corner + 3)]);
  const one = minus(second, first),
    other = minus(third, first),
    across = cross(along, other),
    size = dot(one, across);
  if (Math.abs(size) < 1e-12) return -1;
  const away = minus(start, first),
    u = dot(away, across) / size,
    turn = cross(away, one),
    v = dot(along, turn) / size;
  return u < 0 || v < 0 || u + v > 1 ? -1 : dot(other, turn) / size;
}

function normals(corners) {
  const all = new Float32Array(corners.length);
  for (let at = 0; at < corners.length; at += 9) {
    const [first, second, third] = [0, 3, 6].map((corner) => [...corners.subarray(at + corner, at + corner + 3)]);
    const normal = cross(minus(second, first), minus(third, first)),
      size = Math.hypot(...normal) || 1;
    for (const corner of [0, 3, 6])
      all.set(
        normal.map((value) => value / size),
        at + corner,
      );
  }
  return all;
}

/** An arrow along +x that starts beside a body of this radius. */
function arrow(radius) {
  const length = Math.max(2 * radius, 8),
    thick = 0.06 * length;
  const shaft = new CylinderGeometry(thick, thick, length, 12).translate(0, radius + length / 2, 0);
  const tip = new ConeGeometry(3 * thick, 0.4 * length, 16).translate(0, radius + 1.15 * length, 0);
  const parts = [shaft, tip].map((part) => {
    part.rotateZ(-Math.PI / 2);
    const colours = new Float32Array(part.attributes.position.array.length),
      ink = rgb(COLOURS.ink);
    for (let at = 0; at < colours.length; at += 3) colours.set(ink, at);
    return new Mesh(part.setAttribute("colour", new BufferAttribute(colours, 3)), facetMaterial());
  });
  return new Group().add(...parts);
}

// The workpiece: its facets, coloured by what acted on them, and an arrow along its motion.
import { BufferAttribute, BufferGeometry, ConeGeometry, CylinderGeometry, Group, Mesh, Triangle, Vector3 } from "three";
import { COLOURS, rgb } from "./colours.js";
import { facetMaterial } from "./shading.js";

export class Workpiece {
  constructor(own, columns, top) {
    this.own = own;
    this.columns = columns;
    this.corners = columns.corners;
    this.count = this.corners.length / 9;
    this.tints = new Float32Array(this.corners.length);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.corners, 3));
    geometry.computeVertexNormals(); // no corner is shared: those of the facets
    this.normals = geometry.attributes.normal.array;
    geometry.setAttribute("colour", new BufferAttribute(this.tints, 3));
    this.body = new Mesh(geometry, facetMaterial());
    this.body.frustumCulled = false;
    this.group = new Group().add(this.body);
    this.arrow = arrow(own.radius);
    this.arrow.position.z = top;
  }

  /** Where the workpiece's reference point is at a frame (mm), and its orientation as a quaternion. */
  pose(number) {
    const [x, y, z, ...turn] = this.own.poses[number];
    return { x, y, z, turn, heading: this.own.headings[number] };
  }

  place(number) {
    const { x, y, z, turn, heading } = this.pose(number);
    this.group.position.set(x, y, z);
    this.group.quaternion.set(...turn);
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
    const { position } = this.body.geometry.attributes,
      corners = new Triangle().setFromAttributeAndIndices(position, 3 * number, 3 * number + 1, 3 * number + 2),
      centre = corners.getMidpoint(new Vector3());
    return { centre, depth: this.own.immersion - centre.z, azimuth: Math.atan2(centre.y, centre.x) };
  }

  /** The nearest facet that a ray meets: its number and its distance. */
  hit(caster) {
    const [met] = this.group.visible ? caster.intersectObject(this.body) : [];
    return met && { row: met.faceIndex, distance: met.distance };
  }
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

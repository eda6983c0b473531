// The workpiece: its facets, coloured by what acted on them, and an arrow along its motion; and outlines
// of the bowl, the settled surface of the bed, and the path of the workpiece.
import {
  BufferAttribute,
  BufferGeometry,
  Group,
  LatheGeometry,
  Line,
  LineBasicMaterial,
  Mesh,
  Triangle,
  Vector2,
  Vector3,
} from "three";
import { COLOURS, STEEL, rgb } from "./colours.js";
import { facetMaterial } from "./shading.js";

/** A geometry of this colour. */
export function tinted(geometry, colour) {
  const tints = Array(geometry.attributes.position.count).fill(rgb(colour)).flat();
  return geometry.setAttribute("colour", new BufferAttribute(new Float32Array(tints), 3));
}

export class Workpiece {
  constructor(own, columns, top) {
    Object.assign(this, { own, columns, corners: columns.corners });
    const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(this.corners, 3));
    geometry.computeVertexNormals(); // no corner is shared: those of the facets
    this.normals = geometry.attributes.normal.array;
    this.body = new Mesh(tinted(geometry, COLOURS.workpiece), facetMaterial());
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

  /** The load of this name, if there is one. */
  load(name) {
    return this.own.loads.find((load) => load.name === name);
  }

  /** Colour the facets by a load; plain if there is none of that name. */
  update(look, colourOf) {
    if (this.shown === look.load) return;
    this.shown = look.load;
    this.group.visible = look.load !== "hidden";
    const load = this.load(look.load),
      colours = this.body.geometry.attributes.colour,
      plain = rgb(COLOURS.workpiece);
    for (let corner = 0; corner < colours.count; corner++) {
      const value = load && this.columns[load.name][Math.floor(corner / 3)];
      colours.array.set(load ? colourOf(value / load.top) : plain, 3 * corner);
    }
    colours.needsUpdate = true;
  }

  /** The facet with the largest value of a load. */
  highest(name) {
    const values = this.columns[name];
    return values.indexOf(values.reduce((most, value) => Math.max(most, value)));
  }

  /** Centre of a facet in the workpiece's own frame, its depth below the surface and its azimuth. */
  facet(number) {
    const corners = [0, 1, 2].map((corner) => 3 * number + corner),
      centre = new Triangle()
        .setFromAttributeAndIndices(this.body.geometry.attributes.position, ...corners)
        .getMidpoint(new Vector3());
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
    [thin, thick] = [0.06 * length, 0.18 * length],
    [foot, neck, tip] = [0, 0.95, 1.35].map((part) => radius + part * length);
  const profile = [
    [0, foot],
    [thin, foot],
    [thin, neck],
    [thick, neck],
    [0, tip],
  ];
  const twice = profile.flatMap(([x, y]) => [new Vector2(x, y), new Vector2(x, y)]); // edges stay sharp
  const geometry = new LatheGeometry(twice, 16).rotateZ(-Math.PI / 2);
  return new Group().add(new Mesh(tinted(geometry, COLOURS.ink), facetMaterial()));
}

/** The lines of bowl, surface and path. */
export function outline({ bowl, surface, workpieces }) {
  const line = (points, color) =>
    new Line(new BufferGeometry().setFromPoints(points), new LineBasicMaterial({ color }));
  const onSurface = (points) => line(points.map(([x, y]) => new Vector3(x, y, surface)), STEEL);
  const lines = [
    ...bowl.lines.map((points) => line(points.map((point) => new Vector3(...point)), COLOURS.bowl)),
    ...bowl.surface.map(onSurface),
    ...workpieces.map(({ poses }) => onSurface(poses)),
  ];
  for (const drawn of lines) drawn.frustumCulled = false;
  return new Group().add(...lines);
}

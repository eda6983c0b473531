// The outline of the bowl, the settled surface of the bed, and the path of the workpiece.
import { BufferGeometry, Group, Line, LineSegments, Vector3 } from "three";
import { COLOURS, STEEL, rgb } from "./colours.js";
import { lineMaterial } from "./shading.js";

const PARTS = 96;
const UP = new Vector3(0, 0, 1);

export function outline({ bowl, surface, workpieces }) {
  const soft = lineMaterial(rgb(COLOURS.bowl)),
    steel = lineMaterial(rgb(STEEL));
  const at = (turn, height) => new Vector3(bowl.radius, 0, height).applyAxisAngle(UP, 2 * Math.PI * turn),
    circle = (height) => Array.from({ length: PARTS + 1 }, (_, k) => at(k / PARTS, height));
  const edges = [0, 0.25, 0.5, 0.75].flatMap((turn) => [at(turn, 0), at(turn, bowl.height)]);
  const lines = [
    new Line(geometry(circle(0)), soft),
    new Line(geometry(circle(surface)), steel),
    new Line(geometry(circle(bowl.height)), soft),
    new LineSegments(geometry(edges), soft),
    ...workpieces.map(({ poses }) => new Line(geometry(poses.map(([x, y]) => new Vector3(x, y, surface))), steel)),
  ];
  for (const line of lines) line.frustumCulled = false;
  return new Group().add(...lines);
}

const geometry = (points) => new BufferGeometry().setFromPoints(points);

// The outline of the bowl, the settled surface of the bed, and the path of the workpiece.
import { BufferAttribute, BufferGeometry, Group, Line, LineSegments } from "three";
import { COLOURS, STEEL, rgb } from "./colours.js";
import { lineMaterial } from "./shading.js";

const PARTS = 96;

export function outline({ bowl, surface, workpieces }) {
  const group = new Group(),
    soft = lineMaterial(rgb(COLOURS.bowl)),
    steel = lineMaterial(rgb(STEEL));
  for (const height of [0, surface, bowl.height])
    group.add(line(circle(bowl.radius, height), height === surface ? steel : soft));
  const edges = [0, 1, 2, 3].flatMap((quarter) => {
    const [x, y] = [Math.cos((quarter * Math.PI) / 2), Math.sin((quarter * Math.PI) / 2)].map(
      (value) => value * bowl.radius,
    );
    return [x, y, 0, x, y, bowl.height];
  });
  group.add(new LineSegments(geometry(edges), soft));
  for (const { poses } of workpieces)
    group.add(
      line(
        poses.flatMap(([x, y]) => [x, y, surface]),
        steel,
      ),
    );
  return group;
}

function circle(radius, height) {
  return Array.from({ length: PARTS + 1 }, (_, k) => (2 * Math.PI * k) / PARTS).flatMap((angle) => [
    radius * Math.cos(angle),
    radius * Math.sin(angle),
    height,
  ]);
}

function geometry(points) {
  return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
}

const line = (points, material) => Object.assign(new Line(geometry(points), material), { frustumCulled: false });

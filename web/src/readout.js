// The numbers of what was chosen: a particle, a contact or a facet of the workpiece.
import { CLASSES, DOMINANT, PATH, QUASI_LINEAR } from "./frames.js";
import { digits, fixed, whole } from "./numbers.js";

const degrees = (angle) => `${digits((180 / Math.PI) * angle, 3)}°`;

/** Heading and rows of what was chosen at a frame: [[name, value], ...]. */
export function numbers(chosen, frame, frames, workpiece) {
  if (chosen.facet !== undefined) return facet(chosen.facet, workpiece);
  return chosen.pair ? contact(chosen.pair, frame, frames) : particle(chosen.particle, frame, frames);
}

function particle(id, frame, frames) {
  const row = frame.id.indexOf(id);
  if (row < 0) return [`Particle ${id}`, [["not shown at this time", ""]]];
  const touching = [...frame.a.keys()].filter((k) => frame.a[k] === row || frame.b[k] === row);
  const [x, y, z] = frame.centre.subarray(3 * row, 3 * row + 3);
  return [
    `Particle ${id}`,
    [
      ["diameter", `${digits(2 * frame.radius[row])} mm`],
      ["x, y, z", `${[x, y, z].map((value) => fixed(value, 2)).join(", ")} mm`],
      ["speed", `${digits(frame.speed[row])} mm/s`],
      ["displacement", `${digits(frames.moved(frame)[row], 3)} mm`],
      ["contacts", whole(touching.length)],
      [
        "largest normal force",
        touching.length ? `${digits(Math.max(...touching.map((k) => frame.normal[k])))} N` : "–",
      ],
    ],
  ];
}

function contact([particle, other], frame, frames) {
  const name = /^\d+$/.test(other) ? `Particles ${particle} and ${other}` : `Particle ${particle} and ${other}`;
  const k = frames.find(frame, particle, other);
  if (k < 0) return [name, [["no contact at this time", ""]]];
  const flags = frame.flags[k],
    chains = [
      flags & QUASI_LINEAR && "quasi-linear chain",
      flags & DOMINANT ? "dominant path" : flags & PATH && "path to the bowl",
    ];
  return [
    name,
    [
      ["class", CLASSES[frames.classes(frame)[k]].replace("-", "–")],
      ["normal force", `${digits(frame.normal[k])} N`],
      ["tangential force", `${digits(frame.tangential[k])} N`],
      ["tangential / normal", frame.normal[k] > 0 ? digits(frame.tangential[k] / frame.normal[k], 3) : "–"],
      ["part of", chains.filter(Boolean).join(", ") || "no chain"],
    ],
  ];
}

function facet(number, workpiece) {
  const { depth, azimuth } = workpiece.facet(number),
    { loads } = workpiece.own;
  return [
    `Facet ${number} of the workpiece`,
    [
      ...loads.map(({ name, label, unit }) => [label, `${digits(workpiece.columns[name][number])} ${unit}`]),
      ["depth below surface", `${digits(depth, 3)} mm`],
      ["azimuth from motion", degrees(azimuth)],
    ],
  ];
}

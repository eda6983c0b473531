// What colours and lengths mean.
import { digits, make } from "./dom.js";
import { CLASS_COLOURS, mediaColour } from "./colours.js";
import { CLASSES } from "./data.js";

const SCALES = {
  force: "Normal force of a contact (N)",
  speed: "Speed of a particle (mm/s)",
  displacement: "Displacement of a particle (mm)",
};

/** Fill the legend with the scale of the scene and that of the load on the workpiece. */
export function showLegend(element, { colours, scales, media }, look, load) {
  const key = `${look.colour} ${scales[look.colour]} ${load?.name} ${load?.top}`;
  if (element.dataset.key === key) return;
  element.dataset.key = key;
  const names = media.classes.map(({ name }) => name),
    lists = {
      class: () => list("Class of a contact", CLASSES, (kind) => CLASS_COLOURS[kind]),
      media: () => list("Class of a particle", names, mediaColour),
    };
  const parts = [lists[look.colour]?.() ?? scale(SCALES[look.colour], scales[look.colour], colours)];
  if (load) parts.push(scale(`Workpiece: ${load.label} (${load.unit})`, load.top, colours));
  element.replaceChildren(...parts);
}

function scale(title, top, colours) {
  const words = ["0", digits(top / 2, 3), `≥ ${digits(top, 3)}`].map((text) => make("span", {}, text));
  const bar = make("div", { className: "bar" });
  bar.style.background = `linear-gradient(to right, ${colours.join(", ")})`;
  return make("div", {}, title, bar, make("div", { className: "ends" }, ...words));
}

function list(title, names, colourOf) {
  const rows = names.map((name, number) => {
    const mark = make("i");
    mark.style.background = colourOf(number);
    return make("div", {}, mark, name);
  });
  return make("div", {}, title, ...rows);
}

/** Draw a bar of a round length in mm. */
export function showScale(bar, label, millimetresPerPixel) {
  const rough = 110 * millimetresPerPixel,
    power = 10 ** Math.floor(Math.log10(rough));
  const length = [5, 2, 1].map((factor) => factor * power).find((candidate) => candidate <= rough) ?? power;
  bar.style.width = `${length / millimetresPerPixel}px`;
  label.textContent = `${Number(length.toPrecision(1))} mm`;
}

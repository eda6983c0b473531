// What all charts have in common: uPlot fitted to an element, its axes, and marks over the plotting area.
import uPlot from "uplot";
import style from "uplot/dist/uPlot.min.css";
import { make, plain } from "./dom.js";

document.head.prepend(make("style", {}, style));

/** An axis of uPlot with a name; `more`: options that differ. */
export const axis = (label, more) => ({
  label,
  stroke: "#3d4955",
  font: "11px system-ui, sans-serif",
  labelFont: "12px system-ui, sans-serif",
  lineGap: 1.1,
  size: (plot, _, number) => (plot.axes[number].side % 2 ? 30 : 20),
  labelSize: 15,
  grid: { stroke: "#e3e6ea", width: 0.7 },
  ticks: { show: false },
  values: (_, splits) => splits.map(plain),
  ...more,
});

/** A series of uPlot without points. */
export const line = (options) => ({ points: { show: false }, pxAlign: 0, ...options });

export class Chart {
  constructor(element, options, data) {
    const size = () => ({ width: element.clientWidth || 300, height: element.clientHeight || 200 });
    const always = { legend: { show: false }, hooks: { ...options.hooks, draw: [() => this.layMarks()] } };
    this.marks = [];
    this.plot = new uPlot({ ...size(), ...options, ...always }, data, element);
    new ResizeObserver(() => this.plot.setSize(size())).observe(element);
  }

  /** Mark a stretch: `place()` gives two values along x, and along y unless the mark crosses the chart. */
  mark(className, place, more, layer = this.plot.over) {
    const element = make("i", { className, ...more });
    layer.append(element);
    this.marks.push({ element, place });
    return element;
  }

  layMarks() {
    const { scales } = this.plot;
    for (const { element, place } of this.marks) {
      const at = place();
      element.hidden = !at;
      if (!at) continue;
      const [[left, right], [top, bottom]] = (scales.x.ori ? ["y", "x"] : ["x", "y"]).map((key) =>
        (at[key] ?? [scales[key].min, scales[key].max])
          .map((value) => this.plot.valToPos(value, key))
          .sort((one, other) => one - other),
      );
      element.style.cssText = `left: ${left}px; width: ${right - left}px; top: ${top}px; height: ${bottom - top}px`;
    }
  }
}

// Plays the frames in process time.
import { byId } from "./dom.js";

export class Player {
  /** `page` shows frames; the buttons and the slider below the picture are for it. */
  constructor(page) {
    Object.assign(this, { page, times: page.frames.times, request: null });
    const [speed, slider] = ["speed", "time"].map(byId);
    slider.max = this.times.length - 1;
    slider.oninput = () => page.go(Number(slider.value));
    byId("previous").onclick = () => page.go(page.number - 1);
    byId("next").onclick = () => page.go(page.number + 1);
    byId("play").onclick = () => this.playOrPause();
    speed.onchange = () => (this.speed = Number(speed.value));
    speed.onchange();
    byId("save-picture").onclick = () =>
      page.view.save(`${page.head.run}_${this.times[page.number].toFixed(3)}s.png`);
  }

  playOrPause() {
    if (this.request !== null) this.stop();
    else this.start(this.page.number);
  }

  /** Play from a frame, or from the first one if it is the last, until the end. */
  start(number) {
    const last = this.times.length - 1;
    if (number === last) this.page.show((number = 0));
    let before = performance.now(),
      time = this.times[number];
    const advance = (now) => {
      time += (this.speed * (now - before)) / 1000;
      before = now;
      let next = number;
      while (next < last && this.times[next + 1] <= time) next++;
      if (next !== number) this.page.show((number = next));
      if (number === last) this.stop();
      else this.request = requestAnimationFrame(advance);
    };
    cancelAnimationFrame(this.request);
    this.request = requestAnimationFrame(advance);
    this.tell();
  }

  stop() {
    cancelAnimationFrame(this.request);
    this.request = null;
    this.tell();
  }

  tell() {
    byId("play").textContent = this.request === null ? "Play" : "Pause";
    byId("play").setAttribute("aria-pressed", this.request !== null);
  }
}

// Plays the frames in process time, and saves what is seen as a picture or a film.
import { byId } from "./dom.js";
import { Film, filmKind, savePicture } from "./save.js";

export class Player {
  /** `page` shows frames; the buttons and the slider below the picture are for it. */
  constructor(page) {
    Object.assign(this, { page, times: page.frames.times, request: null });
    const [speed, slider, video] = ["speed", "time", "save-video"].map(byId);
    slider.max = this.times.length - 1;
    slider.oninput = () => page.go(Number(slider.value));
    byId("previous").onclick = () => page.go(page.number - 1);
    byId("next").onclick = () => page.go(page.number + 1);
    byId("play").onclick = () => this.playOrPause();
    speed.onchange = () => (this.speed = Number(speed.value));
    speed.onchange();
    byId("save-picture").onclick = () =>
      savePicture(page.view, `${page.head.run}_${this.times[page.number].toFixed(3)}s`);
    video.disabled = !filmKind();
    if (video.disabled) video.title = "This browser cannot record a canvas.";
    video.onclick = () => (this.film ? this.stop() : this.startFilm());
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
    this.film?.end();
    this.film = null;
    byId("save-video").textContent = "Save video";
  }

  tell() {
    byId("play").textContent = this.request === null ? "Play" : "Pause";
    byId("play").setAttribute("aria-pressed", this.request !== null);
  }

  /** Play all frames and record them. */
  startFilm() {
    this.page.go(0);
    this.page.view.draw(devicePixelRatio);
    this.film = new Film(this.page.view, this.page.head.run, () => this.film && this.start(0));
    byId("save-video").textContent = "End video";
  }
}

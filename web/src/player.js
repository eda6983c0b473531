// Plays the frames in process time.

export class Player {
  /** `show(number)` shows a frame, `told(on)` is called when playing starts or ends. */
  constructor(times, { show, told }) {
    Object.assign(this, { times, show, told, speed: 1 });
    this.request = null;
  }

  get playing() {
    return this.request !== null;
  }

  /** Play from a frame, or from the first one if it is the last, until the end. */
  start(number) {
    const last = this.times.length - 1;
    if (number === last) this.show((number = 0));
    let before = performance.now();
    let time = this.times[number];
    const advance = (now) => {
      time += (this.speed * (now - before)) / 1000;
      before = now;
      let next = number;
      while (next < last && this.times[next + 1] <= time) next++;
      if (next !== number) this.show((number = next));
      if (number === last) this.stop();
      else this.request = requestAnimationFrame(advance);
    };
    cancelAnimationFrame(this.request);
    this.request = requestAnimationFrame(advance);
    this.told(true);
  }

  stop() {
    cancelAnimationFrame(this.request);
    this.request = null;
    this.told(false);
  }
}

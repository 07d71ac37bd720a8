// The slider over the states: which two states are shown, and the values there.

class Player {
  constructor(data, changed) {
    this.data = data;
    this.changed = changed;
    const frames = data.states.map((state) => state.frame);
    // The slider counts frames if each state follows another frame, and else hundredths of states.
    this.byFrame = frames.every((frame, n) => n === 0 || frame > frames[n - 1]);
    this.stations = this.byFrame ? frames : frames.map((_, n) => 100 * n);
    this.slider = document.getElementById("time");
    const [first, last] = [this.stations[0], this.stations[this.stations.length - 1]];
    this.step = this.byFrame ? Math.max(1, Math.round((last - first) / 500)) : 5;
    Object.assign(this.slider, { min: first, max: last, step: this.step, value: last });
    this.slider.addEventListener("input", () => this.stop() || this.show());
    document.getElementById("first").addEventListener("click", () => this.stop() || this.go(first));
    document.getElementById("last").addEventListener("click", () => this.stop() || this.go(last));
    this.button = document.getElementById("play");
    this.button.addEventListener("click", () => (this.playing ? this.stop() : this.play()));
    document.getElementById("player").hidden = this.stations.length < 2;
  }

  go(value) {
    this.slider.value = value;
    this.show();
  }

  // The two states around the slider, and the share of the way from one to the other.
  at() {
    const value = Number(this.slider.value);
    let state = this.stations.findLastIndex((station) => station <= value);
    state = clamp(state, 0, Math.max(0, this.stations.length - 2));
    const next = Math.min(state + 1, this.stations.length - 1);
    const gap = this.stations[next] - this.stations[state];
    return { state, next, part: gap > 0 ? clamp((value - this.stations[state]) / gap, 0, 1) : 0 };
  }

  // The time of the slider, s.
  time() {
    const { state, next, part } = this.at();
    const of = (n) => this.data.states[n].time_s;
    return of(state) + part * (of(next) - of(state));
  }

  // What is shown, in words.
  name({ state, next, part }) {
    const { states } = this.data;
    if (part === 0 || part === 1) {
      const { name, time_s } = states[part === 0 ? state : next];
      return this.byFrame ? `${name}, ${time_s.toFixed(3)} s` : name;
    }
    if (this.byFrame)
      return `frame ${this.slider.value}, ${this.time().toFixed(3)} s, between the kept frames ${states[state].frame} and ${states[next].frame}`;
    return `${Math.round(100 * part)} % of the way from “${states[state].name}” to “${states[next].name}”: no state of the body`;
  }

  // Values of all quantities, or null between states of which none are known.
  values({ state, next, part }) {
    const { rows, states } = this.data;
    if (part === 0 || part === 1) return states[part === 0 ? state : next].values;
    if (!this.byFrame || rows.time_s.length < 2) return null;
    const time = this.time();
    const distance = rows.time_s.map((at) => Math.abs(at - time));
    const row = distance.indexOf(Math.min(...distance));
    return rows.values.map((values) => values[row]);
  }

  // The values as text.
  readings(values) {
    const { quantities } = this.data;
    const text = ({ title, name, unit }, n) => {
      const what = title.startsWith("Opening") ? `opening, ${name}` : `force, ${name}`;
      return `${what}: ${fixed(values[n], 2)} ${unit}`;
    };
    return quantities.slice(0, 8).map(text).join(" · ");
  }

  show() {
    const at = this.at();
    const values = this.values(at);
    const name = this.name(at);
    const text = values && this.data.quantities.length ? `${name} · ${this.readings(values)}` : name;
    this.slider.setAttribute("aria-valuetext", text);
    // A screen reader announces the last text, not each one while it plays.
    if (!this.playing) document.getElementById("state").setAttribute("aria-live", "polite");
    document.getElementById("state").textContent = text;
    this.text = text;
    this.markTime();
    this.changed(at);
  }

  // Marks the time in the plots.
  markTime() {
    const time = this.time();
    for (const svg of document.querySelectorAll(".plot svg[data-x]")) {
      const [left, top, right, bottom] = svg.dataset.area.split(" ").map(Number);
      const [low, high] = svg.dataset.x.split(" ").map(Number);
      const x = left + ((time - low) / (high - low)) * (right - left);
      const line = svg.querySelector(".cursor") || svg.appendChild(document.createElementNS(svg.namespaceURI, "path"));
      line.setAttribute("class", "cursor");
      line.setAttribute("d", `M${x} ${top}V${bottom}`);
    }
  }

  // Lets a click into a plot set the time.
  followPlots() {
    for (const svg of document.querySelectorAll(".plot svg[data-x]")) {
      svg.addEventListener("pointerdown", (event) => {
        const [left, , right] = svg.dataset.area.split(" ").map(Number);
        const [low, high] = svg.dataset.x.split(" ").map(Number);
        const box = svg.getBoundingClientRect();
        const x = ((event.clientX - box.left) / box.width) * svg.viewBox.baseVal.width;
        const time = low + ((x - left) / (right - left)) * (high - low);
        const { states } = this.data;
        const last = states[states.length - 1];
        if (this.byFrame && last.time_s > 0) this.go(Math.round((time / last.time_s) * last.frame));
      });
    }
  }

  play() {
    const [first, last] = [Number(this.slider.min), Number(this.slider.max)];
    const start = Number(this.slider.value) < last ? Number(this.slider.value) : first;
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const duration = 1000 * clamp((last - start) / (this.byFrame ? 15 : 60), 1.5, 8);
    this.playing = true;
    this.button.textContent = "Pause";
    this.button.setAttribute("aria-pressed", "true");
    document.getElementById("state").setAttribute("aria-live", "off");
    if (calm) return this.playSteps();
    let began = null;
    const frame = (now) => {
      if (!this.playing) return;
      began ??= now;
      const part = Math.min(1, (now - began) / duration);
      this.slider.step = "any";
      this.go(start + part * (last - start));
      if (part < 1) requestAnimationFrame(frame);
      else this.stop();
    };
    requestAnimationFrame(frame);
  }

  // Shows the states one after the other, without motion between them.
  playSteps() {
    let { state, next, part } = this.at();
    let number = part === 1 && next === this.stations.length - 1 ? -1 : state;
    const step = () => {
      if (!this.playing) return;
      number += 1;
      this.go(this.stations[number]);
      if (number + 1 < this.stations.length) setTimeout(step, 900);
      else this.stop();
    };
    step();
  }

  stop() {
    if (!this.playing) return;
    this.playing = false;
    this.slider.step = this.step;
    this.button.textContent = "Play";
    this.button.setAttribute("aria-pressed", "false");
    this.show();
  }
}

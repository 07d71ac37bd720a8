// The viewer: a place to look at, a direction and a size. Moves by mouse, touch and keys.

// Tangent of half the vertical field of view.
const HALF_VIEW = Math.tan((14 * Math.PI) / 180);
const STEEPEST = (88 * Math.PI) / 180;
// Directions of the patient along x, y and z, forward and backward.
const LETTERS = [["R", "L"], ["A", "P"], ["S", "I"]];
const NAMES = { R: "right", L: "left", A: "anterior", P: "posterior", S: "superior", I: "inferior" };

class Camera {
  constructor(surface, wound) {
    this.surface = surface;
    this.wound = wound;
    this.look(wound ? "wound" : "whole");
  }

  // Looks at the wound, at the whole skin, or at it from a side that a letter names.
  look(view) {
    const { wound, surface } = this;
    const direction = { A: [0, 1, 0], P: [0, -1, 0], R: [1, 0, 0], L: [-1, 0, 0] }[view];
    if (view === "wound" && wound) {
      this.target = add(wound.middle_mm, surface.middle, -1);
      this.size = 1.1 * wound.size_mm;
      this.face(wound.outward);
      // From a little below and aside, so that a wall of the wound is seen.
      this.turn(0.3, -0.18);
      return;
    }
    this.target = [0, 0, 0];
    this.size = 2 * surface.radius;
    this.face(direction || (wound && wound.outward) || [0, 1, 0]);
  }

  // Looks from a direction of the patient.
  face(direction) {
    const [x, y, z] = normalized(direction);
    this.yaw = Math.atan2(x, y);
    this.pitch = clamp(Math.asin(clamp(z, -1, 1)), -STEEPEST, STEEPEST);
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = clamp(this.pitch + pitch, -STEEPEST, STEEPEST);
  }

  // Moves the picture by shares of its height.
  pan(right, up) {
    const axes = this.axes();
    this.target = add(add(this.target, axes.right, -right * this.size), axes.up, -up * this.size);
    const away = Math.hypot(...this.target);
    const most = 1.5 * this.surface.radius;
    if (away > most) this.target = this.target.map((c) => (c * most) / away);
  }

  zoom(factor) {
    this.size = clamp(this.size * factor, 2, 6 * this.surface.radius);
  }

  axes() {
    const flat = Math.cos(this.pitch);
    const toward = [flat * Math.sin(this.yaw), flat * Math.cos(this.yaw), Math.sin(this.pitch)];
    const right = [-Math.cos(this.yaw), Math.sin(this.yaw), 0];
    return { toward, right, up: cross(toward, right) };
  }

  matrices(aspect) {
    const { toward, right, up } = this.axes();
    // The size is that of the shorter side.
    const distance = this.size / (2 * HALF_VIEW * Math.min(1, aspect));
    const eye = add(this.target, toward, distance);
    const deep = 2.5 * this.surface.radius + Math.hypot(...this.target);
    const near = Math.max(distance / 50, distance - deep);
    const toScreen = times(perspective(HALF_VIEW, aspect, near, distance + deep), viewMatrix(eye, right, up, toward));
    return { eye, right, up, toward, toScreen };
  }

  // The letters of the patient along a direction, the most important first.
  static letters(direction) {
    const parts = direction.map((c, axis) => [Math.abs(c), LETTERS[axis][c < 0 ? 1 : 0]]);
    return parts.filter(([share]) => share > 0.35).sort((a, b) => b[0] - a[0]).map(([, letter]) => letter);
  }

  // Where the viewer is, in words.
  place() {
    return Camera.letters(this.axes().toward).map((letter) => NAMES[letter]).join(" and ");
  }

  // Does what a key means. Returns false for a key without a meaning.
  key(key, shift) {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
    if (step && shift) this.pan(0.06 * step[0], 0.06 * step[1]);
    else if (step) this.turn(-0.12 * step[0], -0.12 * step[1]);
    else if (key === "+" || key === "=") this.zoom(0.85);
    else if (key === "-" || key === "_") this.zoom(1 / 0.85);
    else if (key === "0" || key === "Home") this.look("wound");
    else return false;
    return true;
  }

  // Lets the pointers on a canvas move the viewer. `moved` is called after each change.
  follow(canvas, moved) {
    const pointers = new Map();
    const height = () => Math.max(1, canvas.clientHeight);
    const middle = () => {
      const all = [...pointers.values()];
      const x = all.reduce((sum, p) => sum + p.x, 0) / all.length;
      const y = all.reduce((sum, p) => sum + p.y, 0) / all.length;
      return { x, y, spread: all.reduce((sum, p) => sum + Math.hypot(p.x - x, p.y - y), 0) / all.length };
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    const release = (event) => pointers.delete(event.pointerId);
    ["pointerup", "pointercancel", "lostpointercapture"].forEach((name) => canvas.addEventListener(name, release));
    canvas.addEventListener("pointermove", (event) => {
      if (!pointers.has(event.pointerId)) return;
      const before = middle();
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      const after = middle();
      const [dx, dy] = [(after.x - before.x) / height(), (after.y - before.y) / height()];
      if (pointers.size > 1) {
        this.pan(dx, -dy);
        if (before.spread > 0 && after.spread > 0) this.zoom(before.spread / after.spread);
      } else if (event.shiftKey || event.buttons & 6) this.pan(dx, -dy);
      else this.turn(4 * dx, 4 * dy);
      moved();
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      // A page that scrolls past the view must not zoom it.
      if (document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      this.zoom(Math.exp(clamp(event.deltaY, -200, 200) * 0.0015));
      moved();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !this.key(event.key, event.shiftKey)) return;
      event.preventDefault();
      moved();
    });
  }
}

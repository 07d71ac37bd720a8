// The surface and its states, from the bytes that `surface/encode.rs` describes.

class Surface {
  constructor(about, base64) {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    let at = 0;
    const block = (Type, count) => {
      const values = new Type(bytes.buffer, at, count);
      at += Math.ceil((count * Type.BYTES_PER_ELEMENT) / 4) * 4;
      return values;
    };
    this.about = about;
    this.triangles = block(Uint16Array, 3 * about.triangles);
    const places = block(Uint16Array, 3 * about.points);
    this.tissue = block(Uint8Array, 4 * about.points);
    this.moved = [new Int16Array(3 * about.points)];
    for (let state = 1; state < about.states; state++) {
      const all = new Int16Array(3 * about.points);
      all.set(block(Int16Array, 3 * about.moving));
      this.moved.push(all);
    }
    // Millimeters from the middle of the box around the surface.
    this.middle = about.low_mm.map((low, axis) => (low + about.high_mm[axis]) / 2);
    const offset = about.low_mm.map((low, axis) => low - this.middle[axis]);
    this.rest = Float32Array.from(places, (steps, n) => offset[n % 3] + steps * about.step_mm);
    this.radius = Math.max(1, Math.hypot(...about.low_mm.map((low, axis) => about.high_mm[axis] - low)) / 2);
    this.known = new Map();
  }

  // Depth in mm of the points in wounds below the skin, along the walls, and 0 for those on the skin.
  depths() {
    const { rest, tissue, triangles } = this;
    const key = (n) => rest.subarray(3 * n, 3 * n + 3).join();
    const onSkin = (n) => tissue[4 * n + 3] > 0;
    const lips = new Set();
    const depths = new Float32Array(rest.length / 3);
    for (let n = 0; n < depths.length; n++) if (onSkin(n)) lips.add(key(n));
    for (let n = 0; n < depths.length; n++) if (!onSkin(n)) depths[n] = lips.has(key(n)) ? 0 : Infinity;
    const edges = [];
    for (let t = 0; t < triangles.length; t++) {
      const [a, b] = [triangles[t], triangles[t % 3 === 2 ? t - 2 : t + 1]];
      if (onSkin(a) || onSkin(b)) continue;
      const along = [0, 1, 2].map((axis) => rest[3 * a + axis] - rest[3 * b + axis]);
      edges.push([a, b, Math.hypot(...along)]);
    }
    for (let changed = true, round = 0; changed && round < 100; round++) {
      changed = false;
      for (const [a, b, length] of edges) {
        if (depths[b] > depths[a] + length) [depths[b], changed] = [depths[a] + length, true];
        if (depths[a] > depths[b] + length) [depths[a], changed] = [depths[b] + length, true];
      }
    }
    return depths.map((depth) => (isFinite(depth) ? depth : 0));
  }

  // Unit normals of a state as signed bytes, four for each point.
  normals(state) {
    if (!this.known.has(state)) this.known.set(state, this.computeNormals(state));
    return this.known.get(state);
  }

  computeNormals(state) {
    const { rest, triangles, about } = this;
    const step = about.moved_step_mm;
    const position = Float32Array.from(this.moved[state], (steps, n) => rest[n] + steps * step);
    const sums = new Float32Array(rest.length);
    for (let t = 0; t < triangles.length; t += 3) {
      const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
      const ux = position[b] - position[a], uy = position[b + 1] - position[a + 1], uz = position[b + 2] - position[a + 2];
      const vx = position[c] - position[a], vy = position[c + 1] - position[a + 1], vz = position[c + 2] - position[a + 2];
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
      for (const corner of [a, b, c]) {
        sums[corner] += x;
        sums[corner + 1] += y;
        sums[corner + 2] += z;
      }
    }
    // The steps of the lattice disappear from the light if each normal is the mean of those around it.
    let smooth = normalizedAll(sums);
    for (let round = 0; round < 3; round++) {
      const mean = new Float32Array(smooth.length);
      for (let t = 0; t < triangles.length; t += 3) {
        const corners = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
        for (let axis = 0; axis < 3; axis++) {
          const sum = smooth[corners[0] + axis] + smooth[corners[1] + axis] + smooth[corners[2] + axis];
          for (const corner of corners) mean[corner + axis] += sum;
        }
      }
      smooth = normalizedAll(mean);
    }
    const normals = new Int8Array((4 * rest.length) / 3);
    smooth.forEach((value, n) => (normals[4 * Math.floor(n / 3) + (n % 3)] = Math.round(127 * value)));
    return normals;
  }

  // Largest displacement in mm of a point between two states.
  most(state, next, part) {
    const [a, b] = [this.moved[state], this.moved[next]];
    let most = 0;
    for (let n = 0; n < 3 * this.about.moving; n += 3) {
      const along = (axis) => a[n + axis] + part * (b[n + axis] - a[n + axis]);
      most = Math.max(most, along(0) ** 2 + along(1) ** 2 + along(2) ** 2);
    }
    return Math.sqrt(most) * this.about.moved_step_mm;
  }
}

// Unit vectors, three numbers each.
function normalizedAll(vectors) {
  const units = new Float32Array(vectors.length);
  for (let n = 0; n < vectors.length; n += 3) {
    const length = Math.hypot(vectors[n], vectors[n + 1], vectors[n + 2]) || 1;
    for (let axis = 0; axis < 3; axis++) units[n + axis] = vectors[n + axis] / length;
  }
  return units;
}

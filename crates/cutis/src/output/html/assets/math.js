// Vectors of three numbers, and matrices of 16 numbers in columns.

const add = (a, b, scale = 1) => [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

function normalized(a) {
  const length = Math.hypot(...a);
  return length > 0 ? a.map((c) => c / length) : [0, 1, 0];
}

// From view coordinates to the screen. `height` is the tangent of half the vertical field of view.
function perspective(height, aspect, near, far) {
  const depth = 1 / (near - far);
  return [1 / (height * aspect), 0, 0, 0, 0, 1 / height, 0, 0, 0, 0, (near + far) * depth, -1, 0, 0, 2 * near * far * depth, 0];
}

// From the world to the coordinates of a viewer at `eye` with the axes right, up and toward.
function viewMatrix(eye, right, up, toward) {
  return [
    right[0], up[0], toward[0], 0,
    right[1], up[1], toward[1], 0,
    right[2], up[2], toward[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(toward, eye), 1,
  ];
}

function times(a, b) {
  const out = new Array(16).fill(0);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++)
      for (let n = 0; n < 4; n++) out[4 * column + row] += a[4 * n + row] * b[4 * column + n];
  return out;
}

// A number with a fixed count of decimals. One that rounds to zero has no sign.
function fixed(value, decimals) {
  return value.toFixed(decimals).replace(/^-(?=[0.]*$)/, "");
}

// One, two or five times a power of ten that is at most a value above zero.
function roundBelow(value) {
  const decade = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].find((part) => part * decade <= value) * decade;
}

// The shaders of the view, and the colors of displacements.

// From none to the largest displacement. Each color is darker than the one before it.
const SCALE = [
  [240, 226, 214], [246, 200, 164], [241, 160, 118], [226, 112, 92], [192, 70, 92], [143, 42, 96], [91, 26, 88], [44, 16, 64],
];

const VERTEX = `#version 300 es
layout(location = 0) in vec3 rest;
layout(location = 1) in vec4 tissue;
layout(location = 2) in vec3 moved0;
layout(location = 3) in vec3 moved1;
layout(location = 4) in vec3 normal0;
layout(location = 5) in vec3 normal1;
layout(location = 6) in float depthMm;
uniform mat4 toScreen;
uniform float part, stepMm;
out vec3 at, normal;
out vec4 color;
out float movedMm, below;
void main() {
  vec3 moved = mix(moved0, moved1, part) * stepMm;
  at = rest + moved;
  normal = mix(normal0, normal1, part);
  color = tissue;
  below = depthMm;
  movedMm = length(moved);
  gl_Position = toScreen * vec4(at, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 at, normal;
in vec4 color;
in float movedMm, below;
uniform vec3 eye, light, up;
uniform vec3 scale[${SCALE.length}];
uniform float mostMm;
uniform bool showMoved;
out vec4 pixel;

vec3 linear(vec3 c) { return pow(c, vec3(2.2)); }

vec3 ofDisplacement(float share) {
  float at = clamp(share, 0.0, 1.0) * float(${SCALE.length - 1});
  int low = min(int(at), ${SCALE.length - 2});
  return mix(scale[low], scale[low + 1], at - float(low));
}

void main() {
  vec3 toward = normalize(eye - at);
  vec3 n = normalize(normal);
  bool onSkin = color.a > 0.5;
  vec3 base = linear(onSkin && showMoved ? ofDisplacement(movedMm / mostMm) : onSkin ? vec3(0.91, 0.73, 0.63) : color.rgb);
  // Steep facets of a step face away, but their smooth normals do not.
  if (!gl_FrontFacing && dot(n, toward) < 0.0) {
    n = -n;
    if (onSkin) base = linear(vec3(0.46, 0.49, 0.52));
  }
  float key = max(dot(n, light), 0.0);
  float facing = max(dot(n, toward), 0.0);
  float sky = 0.5 + 0.5 * dot(n, up);
  float gloss = pow(max(dot(n, normalize(light + toward)), 0.0), 36.0);
  vec3 lit = base * (0.16 + 0.14 * sky + 0.62 * key + 0.2 * facing) + vec3(onSkin ? 0.05 : 0.1) * gloss;
  // Less light reaches the bottom of a wound, and it is redder.
  float open = 1.0 / (1.0 + below / 14.0);
  lit *= vec3(open, pow(open, 1.25), pow(open, 1.5));
  pixel = vec4(pow(lit, vec3(1.0 / 2.2)), 1.0);
}`;

// Draws a surface with WebGL 2.

class Renderer {
  // Null if there is no WebGL 2.
  static on(canvas, surface) {
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true, powerPreference: "low-power" });
    return gl && new Renderer(gl, canvas, surface);
  }

  constructor(gl, canvas, surface) {
    Object.assign(this, { gl, canvas, surface, buffers: new Map() });
    this.prepare();
  }

  // Compiles the shaders and sends the parts that do not move.
  prepare() {
    const { gl, surface } = this;
    this.buffers.clear();
    this.program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(gl.getProgramInfoLog(this.program));
    this.places = new Map();
    this.attribute(0, this.buffer(surface.rest), 3, gl.FLOAT, false, 12);
    this.attribute(1, this.buffer(surface.tissue), 4, gl.UNSIGNED_BYTE, true, 4);
    this.attribute(6, this.buffer(surface.depths()), 1, gl.FLOAT, false, 4);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, surface.triangles, gl.STATIC_DRAW);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(this.program);
    gl.uniform3fv(this.place("scale"), SCALE.flat().map((value) => value / 255));
    gl.uniform1f(this.place("stepMm"), surface.about.moved_step_mm);
    gl.uniform1f(this.place("mostMm"), Math.max(surface.about.most_mm, 1e-6));
  }

  place(name) {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.places.get(name);
  }

  buffer(values) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    return buffer;
  }

  attribute(place, buffer, size, type, share, stride) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, share, stride, 0);
  }

  // Displacements and normals of a state, sent when they are first needed.
  state(number) {
    if (!this.buffers.has(number)) {
      const { surface } = this;
      this.buffers.set(number, [this.buffer(surface.moved[number]), this.buffer(surface.normals(number))]);
    }
    return this.buffers.get(number);
  }

  // Draws `part` of the way from a state to the next one.
  draw({ state, next, part }, camera, showMoved) {
    const { gl, canvas, surface } = this;
    const density = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side * density)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    [state, next].forEach((number, n) => {
      const [moved, normals] = this.state(number);
      this.attribute(2 + n, moved, 3, gl.SHORT, false, 6);
      this.attribute(4 + n, normals, 3, gl.BYTE, true, 4);
    });
    const { eye, right, up, toward, toScreen } = camera.matrices(width / height);
    const light = normalized(add(add(toward.map((c) => 0.75 * c), up, 0.6), right, -0.55));
    gl.uniformMatrix4fv(this.place("toScreen"), false, toScreen);
    gl.uniform1f(this.place("part"), part);
    gl.uniform3fv(this.place("eye"), eye);
    gl.uniform3fv(this.place("light"), light);
    gl.uniform3fv(this.place("up"), up);
    gl.uniform1i(this.place("showMoved"), showMoved ? 1 : 0);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.drawElements(gl.TRIANGLES, surface.triangles.length, gl.UNSIGNED_SHORT, 0);
  }
}

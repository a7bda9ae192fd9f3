"use strict";
// Plays flights in space with WebGL 2 alone: all that is drawn are sets of broad line segments.
// flightViewer(root, {flights}) returns {seek, range, show, add, end, onTime, state}. Each flight: name, colour, and
// columns of 32-bit floats in base64: t [s], p, q (xyzw), and where recorded thrust [N], reference, wind [m/s].
(function () {
  const VERTEX = `#version 300 es
    in vec3 a; in vec3 b; in vec4 colour;
    uniform mat4 place; uniform vec2 pixels; uniform float width; uniform vec4 tint;
    out vec4 ink;
    void main() {
      vec4 p = place * vec4(a, 1.0), q = place * vec4(b, 1.0);
      const float near = 0.02;
      ink = colour * tint;
      if (!(p.w > near || q.w > near)) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
      if (p.w < near) p = mix(q, p, (q.w - near) / (q.w - p.w));
      if (q.w < near) q = mix(p, q, (p.w - near) / (p.w - q.w));
      vec2 along = (q.xy / q.w - p.xy / p.w) * pixels;
      along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
      bool last = (gl_VertexID & 2) == 2;
      vec4 at = last ? q : p;
      float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
      at.xy += (vec2(-along.y, along.x) * side + along * (last ? 0.4 : -0.4)) * width / pixels * at.w;
      gl_Position = at;
    }`;
  const FRAGMENT = `#version 300 es
    precision mediump float; in vec4 ink; out vec4 shown;
    void main() { shown = vec4(ink.rgb * ink.a, ink.a); }`;
  const ONE = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const RAMP = [[31, 131, 200], [94, 190, 150], [240, 200, 60], [225, 110, 30], [200, 30, 45]]; // no error to the largest
  const WIDTHS = { t: 1, p: 3, q: 4, thrust: 1, reference: 3, wind: 3 };
  const GREY = [0.5, 0.54, 0.58];

  const decoded = (text) => new Float32Array(Uint8Array.from(atob(text), (each) => each.charCodeAt(0)).buffer);
  const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
  const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
  const length = (x, y, z) => Math.hypot(x, y, z);

  function element(parent, tag, name, text) {
    const made = document.createElement(tag);
    if (name) made.className = name;
    if (text) made.textContent = text;
    parent.append(made);
    return made;
  }

  function ramp(share) {
    const at = clamp(share, 0, 1) * (RAMP.length - 1);
    const low = Math.min(RAMP.length - 2, Math.floor(at));
    return RAMP[low].map((value, k) => (value + (at - low) * (RAMP[low + 1][k] - value)) / 255);
  }

  // Column-major product of two 4 x 4 matrices.
  function product(m, n) {
    const out = new Float32Array(16);
    for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) {
      for (let k = 0; k < 4; k++) out[4 * c + r] += m[4 * k + r] * n[4 * c + k];
    }
    return out;
  }

  // The pose of a body of a size: position p, attitude q (xyzw).
  function pose(p, [x, y, z, w], size) {
    return [
      size * (1 - 2 * (y * y + z * z)), size * 2 * (x * y + z * w), size * 2 * (x * z - y * w), 0,
      size * 2 * (x * y - z * w), size * (1 - 2 * (x * x + z * z)), size * 2 * (y * z + x * w), 0,
      size * 2 * (x * z + y * w), size * 2 * (y * z - x * w), size * (1 - 2 * (x * x + y * y)), 0, ...p, 1];
  }

  // Segments (pairs of points) of a vehicle with arms of length 1: four arms, four rotors, and a nose.
  function vehicle() {
    const pairs = [];
    for (let arm = 0; arm < 4; arm++) {
      const angle = Math.PI * (0.25 + 0.5 * arm), x = Math.cos(angle), y = Math.sin(angle);
      pairs.push(0, 0, 0, x, y, 0);
      for (let k = 0; k < 20; k++) {
        for (const turn of [k, k + 1].map((each) => each * Math.PI / 10)) {
          pairs.push(x + 0.45 * Math.cos(turn), y + 0.45 * Math.sin(turn), 0.08);
        }
      }
    }
    pairs.push(0, 0, 0, 0.6, 0, 0, 0.6, 0, 0, 0.42, 0.12, 0, 0.6, 0, 0, 0.42, -0.12, 0);
    return pairs;
  }

  // An arrow of length 1 along z.
  const ARROW = [0, 0, 0, 0, 0, 1, 0, 0, 1, 0.08, 0, 0.86, 0, 0, 1, -0.08, 0, 0.86, 0, 0, 1, 0, 0.08, 0.86, 0, 0, 1, 0, -0.08, 0.86];
  const MARK = [-1, 0, 0, 1, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, -1, 0, 0, 1];

  // The attitude that turns z into a direction.
  function towards(x, y, z) {
    const size = length(x, y, z) || 1;
    if (z / size < -0.9999) return [1, 0, 0, 0];
    const q = [-y / size, x / size, 0, 1 + z / size], norm = Math.hypot(...q);
    return q.map((each) => each / norm);
  }

  class Flight {
    constructor({ name, colour, ownReference, ...columns }) {
      Object.assign(this, { name, ownReference, colour: rgb(colour), shown: true, n: 0 }, ...["t", "p", "q"].map((key) => ({ [key]: new Float32Array(0) })));
      this.add(Object.fromEntries(Object.entries(columns).map(([key, text]) => [key, decoded(text)])));
    }

    add(columns) {
      for (const key of Object.keys(WIDTHS)) {
        if (!(key in columns)) continue;
        const before = this[key] || new Float32Array(0), all = new Float32Array(before.length + columns[key].length);
        all.set(before);
        all.set(columns[key], before.length);
        this[key] = all;
      }
      this.n = this.t.length;
      this.error = this.reference && this.t.map((_, i) => length(...[0, 1, 2].map((k) => this.p[3 * i + k] - this.reference[3 * i + k])));
      const thrusts = (this.thrust || []).filter(Number.isFinite);
      this.meanThrust = thrusts.reduce((sum, each) => sum + each, 0) / thrusts.length || 1;
    }

    // The sample at or before t, and how far (0 to 1) t is from there to the next.
    place(t) {
      let low = 0, high = this.n - 1;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (this.t[middle] <= t) low = middle; else high = middle;
      }
      const next = Math.min(low + 1, this.n - 1), step = this.t[next] - this.t[low];
      return { low, next, share: step > 0 ? clamp((t - this.t[low]) / step, 0, 1) : 0 };
    }

    value(key, { low, next, share }) {
      const width = WIDTHS[key] || 1, column = this[key];
      if (!column) return null;
      const out = Array.from({ length: width }, (_, k) => column[width * low + k]);
      const sign = key === "q" && out.reduce((sum, each, k) => sum + each * column[width * next + k], 0) < 0 ? -1 : 1;
      const mixed = out.map((each, k) => each + share * (sign * column[width * next + k] - each));
      if (!mixed.every(Number.isFinite)) return null;
      const size = Math.hypot(...mixed);
      return key === "q" ? mixed.map((each) => each / size) : mixed;
    }
  }

  function painter(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true });
    if (!gl) return null;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    const [a, b, colour] = ["a", "b", "colour"].map((name) => gl.getAttribLocation(program, name));
    const at = (name) => gl.getUniformLocation(program, name);
    const places = Object.fromEntries(["place", "pixels", "width", "tint"].map((name) => [name, at(name)]));
    for (const each of [a, b]) gl.enableVertexAttribArray(each);
    const corners = gl.createBuffer();
    let seen = ONE, most = 0; // segments that the corners are there for
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);

    // Returns a buffer of the four corners of each segment: the numbers of its two ends, or of `wide` values of one.
    function buffer(values, made, { path = false, wide = 0 } = {}) {
      const size = wide || 6, step = wide || (path ? 3 : 6), count = Math.max(0, Math.floor((values.length - size) / step) + 1);
      const out = new Float32Array(4 * size * count), numbers = Float32Array.from(values);
      for (let k = 0; k < 4 * count; k++) out.set(numbers.subarray((k >> 2) * step, (k >> 2) * step + size), k * size);
      const kept = made || gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, kept);
      gl.bufferData(gl.ARRAY_BUFFER, out, gl.STATIC_DRAW);
      if (count > most) {
        most = 2 * count;
        const order = Uint32Array.from({ length: 6 * most }, (_, k) => 4 * Math.floor(k / 6) + [0, 1, 2, 2, 1, 3][k % 6]);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, corners);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, order, gl.STATIC_DRAW);
      }
      return kept;
    }

    function begin(camera, ratio) {
      const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((each) => Math.max(1, Math.round(each * ratio)));
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      gl.viewport(0, 0, width, height);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      seen = camera;
      gl.uniform2f(places.pixels, width / ratio, height / ratio);
    }

    // Draws the segments first to last.
    function draw(points, { first = 0, last, colours = null, tint = [1, 1, 1, 1], width = 2, model = ONE, over = false }) {
      if (last <= first) return;
      gl.bindBuffer(gl.ARRAY_BUFFER, points);
      gl.vertexAttribPointer(a, 3, gl.FLOAT, false, 24, 0);
      gl.vertexAttribPointer(b, 3, gl.FLOAT, false, 24, 12);
      if (colours) {
        gl.enableVertexAttribArray(colour);
        gl.bindBuffer(gl.ARRAY_BUFFER, colours);
        gl.vertexAttribPointer(colour, 4, gl.FLOAT, false, 16, 0);
      } else {
        gl.disableVertexAttribArray(colour);
        gl.vertexAttrib4f(colour, 1, 1, 1, 1);
      }
      gl.uniformMatrix4fv(places.place, false, model === ONE ? seen : product(seen, model));
      gl.uniform1f(places.width, width);
      gl.depthFunc(over ? gl.ALWAYS : gl.LEQUAL); // bodies in one place would show each other in patches
      gl.uniform4fv(places.tint, tint);
      gl.drawElements(gl.TRIANGLES, 6 * (last - first), gl.UNSIGNED_INT, 24 * first);
    }
    return { buffer, begin, draw };
  }

  window.flightViewer = function (root, data) {
    root.tabIndex = 0;
    const stage = element(root, "div", "stage"), canvas = element(stage, "canvas");
    const paint = painter(canvas);
    if (!paint) {
      stage.textContent = "This browser has no WebGL 2: the flight cannot be played here.";
      return null;
    }
    const ink = rgb(getComputedStyle(root).getPropertyValue("--ink").trim() || "#1d2530");
    const flights = data.flights.map((each) => new Flight(each));
    const main = flights[0], listeners = [];
    const axes = ["x", "y", "z"].map((name) => element(stage, "span", "axis", name));
    const hud = element(stage, "div", "hud"), scale = element(stage, "div", "scale");
    const bar = element(root, "div", "controls");
    const play = element(bar, "button", "play", "▶"), slider = element(bar, "input"), clock = element(bar, "output");
    const speed = element(bar, "select");
    play.type = "button";
    play.setAttribute("aria-label", "play or pause");
    Object.assign(slider, { type: "range", step: "any" });
    slider.setAttribute("aria-label", "time in s");
    speed.setAttribute("aria-label", "speed");
    for (const each of [0.1, 0.25, 0.5, 1, 2, 4, 8]) element(speed, "option", "", `${each} x`).value = String(each);
    speed.value = "1";
    const state = { t: 0, low: 0, high: 1, playing: false, view: "orbit", frames: 0, live: false, growing: false, reference: true, ended: "" };
    const camera = { yaw: -1.0, pitch: 0.45, distance: 5, target: [0, 0, 0], shift: [0, 0, 0] };
    const scene = { centre: [0, 0, 0], extent: 1, arm: 0.2, worst: 1, grid: 0 };
    const shapes = { vehicle: paint.buffer(vehicle()), arrow: paint.buffer(ARROW), mark: paint.buffer(MARK), grid: null, axes: null };
    const parts = { vehicle: vehicle().length / 6, arrow: ARROW.length / 6, mark: MARK.length / 6 };
    let asked = false, last = 0;

    // Takes the bounds of all that was flown, and gives lines and colours to WebGL.
    function measure() {
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (const flight of flights) for (const column of [flight.p, flight.reference]) {
        for (let i = 0; column && i < column.length; i++) {
          if (column[i] < low[i % 3]) low[i % 3] = column[i];
          if (column[i] > high[i % 3]) high[i % 3] = column[i];
        }
      }
      if (!low.every(Number.isFinite)) return;
      scene.centre = low.map((each, k) => 0.5 * (each + high[k]));
      scene.extent = Math.max(1, ...low.map((each, k) => high[k] - each));
      scene.arm = Math.max(0.2, 0.04 * scene.extent);
      const worst = (flight) => (flight.error || []).reduce((most, each, i) => (flight.t[i] >= 0 && each > most ? each : most), 0);
      scene.worst = Math.max(1e-6, ...flights.map(worst));
      flights.forEach((flight, place) => {
        const colours = new Float32Array(4 * flight.n);
        for (let i = 0; i < flight.n; i++) {
          const known = place === 0 && flight.error && Number.isFinite(flight.error[i]);
          colours.set([...(known ? ramp(flight.error[i] / scene.worst) : flight.colour), 1], 4 * i);
        }
        flight.path = paint.buffer(flight.p, flight.path, { path: true });
        flight.colours = paint.buffer(colours, flight.colours, { wide: 4 });
        if (!flight.reference) return;
        const held = Float32Array.from(flight.reference); // where there is none the one before it is drawn, a point
        for (let i = 3; i < held.length; i++) if (!Number.isFinite(held[i])) held[i] = held[i - 3];
        flight.wanted = paint.buffer(held, flight.wanted, { path: true });
        flight.known = Math.max(0, flight.error.findIndex(Number.isFinite));
      });
      ground(Math.min(0, low[2]));
      scale.hidden = !main.error;
      scale.textContent = `error 0 to ${metres(scene.worst)}`;
    }

    // A grid of 1, 2 or 5 times a power of ten, and the axes at its corner.
    function ground(z) {
      const tenth = 10 ** Math.floor(Math.log10(scene.extent / 3)), wide = tenth * [5, 2, 1].find((each) => each * tenth <= scene.extent / 3);
      const count = Math.ceil(0.6 * scene.extent / wide), pairs = [];
      const [x, y] = scene.centre.map((each) => Math.round(each / wide) * wide), far = count * wide;
      for (let k = -count; k <= count; k++) {
        pairs.push(x + k * wide, y - far, z, x + k * wide, y + far, z, x - far, y + k * wide, z, x + far, y + k * wide, z);
      }
      Object.assign(scene, { grid: wide, lines: pairs.length / 6, corner: [x - far, y - far, z] });
      shapes.grid = paint.buffer(pairs, shapes.grid);
      shapes.axes = paint.buffer([0, 1, 2].flatMap((k) => [...scene.corner, ...scene.corner.map((each, i) => each + (i === k ? wide : 0))]), shapes.axes);
    }

    const metres = (value) => (value < 0.1 ? `${(1000 * value).toPrecision(3)} mm` : `${value.toPrecision(3)} m`);

    function matrix() {
      const { yaw, pitch, distance, target, shift } = camera;
      const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
      const back = [cp * cy, cp * sy, sp], right = [-sy, cy, 0], up = [-sp * cy, -sp * sy, cp];
      const eye = target.map((each, k) => each + shift[k] + distance * back[k]);
      const dot = (one) => -(one[0] * eye[0] + one[1] * eye[1] + one[2] * eye[2]);
      const view = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, dot(right), dot(up), dot(back), 1];
      const aspect = Math.max(0.1, canvas.clientWidth / Math.max(1, canvas.clientHeight)), f = aspect < 1 ? 1.9 * aspect : 1.9;
      const near = 0.01 * distance, far = 60 * (distance + scene.extent), depth = near - far;
      const lens = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / depth, -1, 0, 0, 2 * far * near / depth, 0];
      return product(lens, view);
    }

    function look(view) {
      Object.assign(state, { view, looked: scene.extent });
      const far = 1.25 * scene.extent + 4 * scene.arm;
      const angles = { orbit: [-1.0, 0.45], follow: [-2.6, 0.3], top: [-Math.PI / 2, Math.PI / 2], side: [-Math.PI / 2, 0] }[view];
      Object.assign(camera, { yaw: angles[0], pitch: angles[1], distance: view === "follow" ? 10 * scene.arm : far, shift: [0, 0, 0] });
      for (const button of bar.querySelectorAll("button[data-view]")) button.setAttribute("aria-pressed", String(button.dataset.view === view));
      ask();
    }

    function label(span, point, seen) {
      const out = [0, 1, 3].map((r) => seen[r] * point[0] + seen[4 + r] * point[1] + seen[8 + r] * point[2] + seen[12 + r]);
      span.hidden = out[2] <= 0;
      span.style.transform = `translate(${(0.5 + 0.5 * out[0] / out[2]) * canvas.clientWidth}px, ${(0.5 - 0.5 * out[1] / out[2]) * canvas.clientHeight}px)`;
    }

    function drawFlight(flight, seen) {
      if (!flight.shown || !flight.n) return;
      const ghost = flight !== main, here = flight.place(state.t), p = flight.value("p", here), q = flight.value("q", here);
      const lines = { colours: flight.colours }, all = flight.n - 1;
      if (flight.reference && state.reference && (!ghost || flight.ownReference)) {
        paint.draw(flight.wanted, { first: flight.known, last: all, width: 1.2, tint: [...GREY, 0.7] });
      }
      paint.draw(flight.path, { ...lines, last: here.next, width: ghost ? 1.2 : 2 });
      paint.draw(flight.path, { ...lines, first: here.next, last: all, width: 1, tint: [1, 1, 1, 0.28] });
      if (!p || !q) return;
      const colour = ghost ? flight.colour : ink;
      paint.draw(shapes.vehicle, { over: true, last: parts.vehicle, model: pose(p, q, scene.arm), tint: [...colour, ghost ? 0.55 : 1], width: ghost ? 1.2 : 1.8 });
      const thrust = flight.value("thrust", here), wind = flight.value("wind", here), wanted = flight.value("reference", here);
      const arrow = { over: true, last: parts.arrow, width: ghost ? 1.2 : 2 };
      if (thrust) paint.draw(shapes.arrow, { ...arrow, model: pose(p, q, 1.6 * scene.arm * thrust[0] / flight.meanThrust), tint: [0.84, 0.37, 0, ghost ? 0.5 : 1] });
      if (wanted && state.reference && !ghost) paint.draw(shapes.mark, { over: true, last: parts.mark, model: pose(wanted, [0, 0, 0, 1], 0.35 * scene.arm), tint: [...GREY, 1] });
      if (wind && !ghost && length(...wind) > 1e-3) {
        const size = scene.arm * clamp(0.5 * length(...wind), 0.5, 4);
        paint.draw(shapes.arrow, { ...arrow, model: pose(p, towards(...wind), size), tint: [0.16, 0.62, 0.78, 1] });
      }
    }

    function tell() {
      const here = main.place(state.t), p = main.value("p", here), q = main.value("q", here);
      const wind = main.value("wind", here), thrust = main.value("thrust", here), error = main.value("error", here);
      const tilt = q && Math.acos(clamp(1 - 2 * (q[0] * q[0] + q[1] * q[1]), -1, 1)) * 180 / Math.PI;
      const said = [p && `height ${p[2].toFixed(2)} m`, error && `error ${metres(error[0])}`, q && `tilt ${tilt.toFixed(1)}°`,
        thrust && `thrust ${thrust[0].toFixed(2)} N`, wind && length(...wind) > 1e-3 && `wind ${length(...wind).toFixed(1)} m/s`, `grid ${scene.grid} m`, state.ended];
      hud.textContent = said.filter(Boolean).join("   ");
      clock.textContent = `${state.t.toFixed(2)} s`;
      slider.value = String(state.t);
    }

    function frame(now) {
      asked = false;
      const passed = Math.min(0.2, (now - last) / 1000);
      last = now;
      if (state.live && main.n) state.t += (main.t[main.n - 1] - state.t) * Math.min(1, 6 * passed);
      else if (state.playing) {
        state.t += passed * Number(speed.value);
        if (state.t >= state.high) pause((state.t = state.high));
      }
      const p = main.n && main.value("p", main.place(state.t));
      camera.target = state.view === "follow" && p ? p : scene.centre;
      const seen = matrix();
      paint.begin(seen, Math.min(2, window.devicePixelRatio || 1));
      if (shapes.grid) paint.draw(shapes.grid, { last: scene.lines, width: 0.5, tint: [...GREY, 0.35] });
      if (shapes.axes) paint.draw(shapes.axes, { last: 3, width: 1.4, tint: [...GREY, 1] });
      for (const flight of [...flights].reverse()) drawFlight(flight, seen);
      if (scene.corner) axes.forEach((span, k) => label(span, scene.corner.map((each, i) => each + (i === k ? 1.1 * scene.grid : 0)), seen));
      if (main.n) tell();
      state.frames += 1;
      for (const each of listeners) each(state.t);
      if (state.playing || state.live) ask();
    }

    function ask() {
      if (!asked) requestAnimationFrame(frame);
      asked = true;
    }

    function pause() {
      state.playing = false;
      play.textContent = "▶";
    }

    function toggle() {
      if (state.playing) return pause();
      if (state.t >= state.high - 1e-3) state.t = state.low;
      Object.assign(state, { playing: true, live: false });
      play.textContent = "❚❚";
      last = performance.now();
      ask();
    }

    function seek(t) {
      state.live = state.growing && t >= state.high; // End of a flight under way: its newest again
      state.t = clamp(t, state.low, state.high);
      ask();
    }

    function range(low, high) {
      Object.assign(state, { low, high });
      Object.assign(slider, { min: String(low), max: String(high) });
      if (!state.live) state.t = clamp(state.t, low, high);
      ask();
    }

    const views = { orbit: "1", follow: "2", top: "3", side: "4" };
    for (const view of Object.keys(views)) {
      const button = element(bar, "button", "", view);
      Object.assign(button, { type: "button", title: `key ${views[view]}` });
      button.dataset.view = view;
      button.addEventListener("click", () => look(view));
    }
    play.addEventListener("click", toggle);
    slider.addEventListener("input", () => seek(Number(slider.value)));
    root.addEventListener("keydown", (event) => {
      const view = Object.keys(views).find((each) => views[each] === event.key);
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (event.target === speed || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key === " ") toggle();
      else if (view) look(view);
      else if (step) seek(state.t + step * (event.shiftKey ? 0.1 : 1));
      else if (event.key === "Home" || event.key === "End") seek(event.key === "Home" ? state.low : state.high);
      else return;
      event.preventDefault();
    });

    const fingers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => fingers.delete(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
      const other = [...fingers].find(([id]) => id !== event.pointerId);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      if (other) {
        const apart = ([x, y]) => Math.max(1, Math.hypot(x - other[1][0], y - other[1][1]));
        zoom(apart(before) / apart([event.clientX, event.clientY]));
      } else if (event.buttons & 2 || event.shiftKey) {
        const move = 1.1 * camera.distance / Math.max(1, canvas.clientHeight), { yaw, pitch } = camera;
        const right = [-Math.sin(yaw), Math.cos(yaw), 0], up = [-Math.sin(pitch) * Math.cos(yaw), -Math.sin(pitch) * Math.sin(yaw), Math.cos(pitch)];
        camera.shift = camera.shift.map((each, k) => each + move * (dy * up[k] - dx * right[k]));
      } else {
        camera.yaw -= 0.008 * dx;
        camera.pitch = clamp(camera.pitch + 0.008 * dy, -Math.PI / 2, Math.PI / 2);
      }
      ask();
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== root && !root.contains(document.activeElement)) return; // the page scrolls
      event.preventDefault();
      zoom(Math.exp(0.001 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("click", () => root.focus({ preventScroll: true }));

    function zoom(factor) {
      camera.distance = clamp(camera.distance * factor, 0.5 * scene.arm, 20 * scene.extent);
      ask();
    }

    measure();
    look("orbit");
    if (main.n) range(Math.min(...flights.map((each) => each.t[0])), Math.max(...flights.map((each) => each.t[each.n - 1])));
    new ResizeObserver(ask).observe(canvas);
    return {
      state, camera, seek, range, look, ask,
      onTime: (listener) => listeners.push(listener),
      show(name, shown) {
        if (name === "/reference") state.reference = shown;
        for (const flight of flights) if (flight.name === name) flight.shown = shown;
        ask();
      },
      add(columns) { // a flight under way: the newest is shown until somebody scrubs
        const first = main.n === 0;
        const numbers = (values) => Float32Array.from(values, (each) => (each === null ? NaN : each));
        main.add(Object.fromEntries(Object.entries(columns).map(([key, values]) => [key, numbers(values)])));
        measure();
        if (first) Object.assign(state, { live: true, growing: true, t: main.t[0] });
        if (first || scene.extent > 1.3 * state.looked) look(state.view);
        range(main.t[0], main.t[main.n - 1]);
      },
      end(text) {
        Object.assign(state, { ended: text, live: false, growing: false });
        ask();
      },
    };
  };
})();

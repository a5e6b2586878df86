"use strict";
(() => {
  // --- tables ---
  for (const table of document.querySelectorAll("table.sortable")) {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => head.addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      heads.forEach((h) => h.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const value = (row) => {
        const cell = row.cells[Math.min(column, row.cells.length - 1)];
        if (column === 0) return cell.textContent;
        const number = Number(cell.dataset.value);
        return cell.dataset.value === "" || Number.isNaN(number) ? Infinity : number;
      };
      const order = (a, b) => {
        const x = value(a), y = value(b);
        if (column === 0) return (up ? 1 : -1) * x.localeCompare(y);
        if (x === y) return 0;
        if (x === Infinity || y === Infinity) return x === Infinity ? 1 : -1; // what failed stays last
        return up ? x - y : y - x;
      };
      table.tBodies[0].append(...[...table.tBodies[0].rows].sort(order));
    }));
  }

  // --- values under the mouse ---
  const tip = document.getElementById("tip");
  const say = (text, e) => {
    tip.hidden = !text;
    if (!text) return;
    tip.textContent = text;
    const { width, height } = tip.getBoundingClientRect(), gap = 14;
    const x = e.clientX + gap + width > innerWidth ? e.clientX - gap - width : e.clientX + gap;
    const y = e.clientY + gap + height > innerHeight ? e.clientY - gap - height : e.clientY + gap;
    tip.style.transform = `translate(${Math.max(x, 2)}px,${Math.max(y, 2)}px)`;
  };
  const quiet = () => say("");
  for (const each of document.querySelectorAll("[data-tip]")) {
    each.addEventListener("pointermove", (e) => say(each.dataset.tip, e));
    each.addEventListener("pointerleave", quiet);
  }
  for (const plot of document.querySelectorAll(".plot")) {
    const marks = JSON.parse(plot.dataset.marks), svg = plot.querySelector("svg");
    plot.addEventListener("pointermove", (e) => {
      const b = svg.getBoundingClientRect();
      let nearest = 24 ** 2, found = ""; // pixels away, and no further
      for (const [x, y, text] of marks) {
        const far = (b.left + x * b.width - e.clientX) ** 2 + (b.top + y * b.height - e.clientY) ** 2;
        if (far < nearest) [nearest, found] = [far, text];
      }
      say(found, e);
    });
    plot.addEventListener("pointerleave", quiet);
  }
  addEventListener("scroll", quiet, { passive: true });

  // --- the views ---
  const data = JSON.parse(document.getElementById("data").textContent);
  const canvas = document.getElementById("gl"), grid = document.getElementById("grid");
  const cells = [...document.querySelectorAll(".cell")];
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl) {
    document.body.classList.add("no-webgl");
    document.getElementById("nogl").hidden = false;
    return;
  }
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const buffer = (target, text) => {
    const made = gl.createBuffer();
    gl.bindBuffer(target, made);
    gl.bufferData(target, bytes(text), gl.STATIC_DRAW);
    return made;
  };
  const shader = (type, text) => {
    const made = gl.createShader(type);
    gl.shaderSource(made, "#version 300 es\nprecision highp float;\n" + text);
    gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
    return made;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `
    in vec3 before; in vec3 after; in float value;
    uniform mat3 turn; uniform vec3 middle, size; uniform vec2 shift, span, range; uniform float mixed, radius;
    out vec3 seen; out float shade;
    void main() {
      vec3 p = turn * (mix(before, after, mixed) * size - middle);
      seen = p; shade = clamp((value - range.x) / max(range.y - range.x, 1e-30), 0.0, 1.0);
      gl_Position = vec4((p.xy + shift) / span, -p.z / radius * 0.5, 1.0);
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
    in vec3 seen; in float shade; uniform sampler2D ramp; uniform bool colored; out vec4 color;
    void main() {
      vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
      bool back = !gl_FrontFacing;
      vec3 base = colored ? texture(ramp, vec2(shade * (255.0 / 256.0) + 0.5 / 256.0, 0.5)).rgb : vec3(0.85, 0.79, 0.66);
      if (back) base = mix(base, vec3(0.45, 0.5, 0.6), 0.6);
      float side = max(dot(n, normalize(vec3(-1.0, 0.9, 0.9))), 0.0), front = max(n.z, 0.0);
      float light = colored ? 0.5 + 0.25 * side + 0.28 * front : 0.14 + 0.68 * side + 0.3 * front;
      float gloss = colored ? 0.0 : 0.08 * pow(max(dot(n, normalize(vec3(-0.5, 0.45, 1.4))), 0.0), 14.0);
      color = vec4(base * light + gloss, 1.0);
    }`));
  gl.bindAttribLocation(program, 0, "before");
  gl.bindAttribLocation(program, 1, "after");
  gl.bindAttribLocation(program, 2, "value");
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = (name) => gl.getUniformLocation(program, name);
  const at = Object.fromEntries(["turn", "middle", "size", "shift", "span", "range", "mixed", "radius", "colored"].map((n) => [n, uniform(n)]));
  const faces = buffer(gl.ELEMENT_ARRAY_BUFFER, data.faces);
  const indexType = data.wide ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;
  const shorts = (text) => new Uint16Array(bytes(text).buffer);
  const meshes = data.meshes.map((m) => ({
    places: shorts(m.positions),
    halves: Object.fromEntries(Object.entries(m.values).map(([key, text]) => [key, shorts(text)])),
    positions: buffer(gl.ARRAY_BUFFER, m.positions),
    values: Object.fromEntries(Object.entries(m.values).map(([key, text]) => [key, buffer(gl.ARRAY_BUFFER, text)])),
  }));
  const ramp = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, ramp);
  for (const p of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, p, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.SCISSOR_TEST);

  // one camera for all: row-major rotation, shift and height of the view in mesh units
  const product = (a, b) => a.map((_, i) => [0, 1, 2].reduce((sum, k) => sum + a[3 * Math.floor(i / 3) + k] * b[3 * k + (i % 3)], 0));
  const about = (x, y) => {
    const [c, s, d, t] = [Math.cos(y), Math.sin(y), Math.cos(x), Math.sin(x)];
    return product([1, 0, 0, 0, d, -t, 0, t, d], [c, 0, s, 0, 1, 0, -s, 0, c]);
  };
  const whole = () => ({ turn: about(0.15, -0.24), shift: [0, 0], height: data.height });
  const state = { ...whole(), mixed: 1, color: "", frames: 0 };
  let asked = false;
  const draw = () => {
    asked = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 2), box = grid.getBoundingClientRect();
    const [w, h] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
    if (w < 1 || h < 1) return; // in print
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    gl.scissor(0, 0, w, h);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix3fv(at.turn, true, state.turn);
    gl.uniform3fv(at.middle, data.middle);
    gl.uniform3fv(at.size, data.size);
    gl.uniform1f(at.mixed, state.mixed);
    gl.uniform1f(at.radius, data.radius);
    const title = 40 * ratio; // pixels of a cell that its name takes
    cells.forEach((cell, i) => {
      if (cell.hidden) return;
      const b = cell.getBoundingClientRect(), mesh = meshes[i];
      const [x, y, cw, ch] = [b.left - box.left, box.bottom - b.bottom, b.width, b.height].map((v) => Math.round(v * ratio));
      if (ch <= title) return;
      gl.viewport(x, y, cw, ch - title);
      gl.scissor(x, y, cw, ch - title);
      const tall = state.height / 2;
      gl.uniform2f(at.span, (tall * cw) / (ch - title), tall);
      gl.uniform2fv(at.shift, state.shift);
      const values = mesh.values[state.color];
      gl.uniform1i(at.colored, values ? 1 : 0);
      if (values) gl.uniform2f(at.range, data.scales[state.color].low, data.scales[state.color].high);
      [meshes[data.before].positions, mesh.positions].forEach((made, k) => {
        gl.bindBuffer(gl.ARRAY_BUFFER, made);
        gl.enableVertexAttribArray(k);
        gl.vertexAttribPointer(k, 3, gl.UNSIGNED_SHORT, true, 0, 0);
      });
      if (values) {
        gl.bindBuffer(gl.ARRAY_BUFFER, values);
        gl.enableVertexAttribArray(2);
        gl.vertexAttribPointer(2, 1, gl.HALF_FLOAT, false, 0, 0);
      } else gl.disableVertexAttribArray(2);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, faces);
      gl.drawElements(gl.TRIANGLES, data.corners, indexType, 0);
    });
    measure();
    state.frames += 1;
  };
  // a bar in each view: a length of 1, 2 or 5 times a power of ten, in mesh units
  const measure = () => {
    const unit = scale() * data.extent, most = 90 * unit; // mesh units a pixel, and of the longest bar
    const power = 10 ** Math.floor(Math.log10(most)), length = [5, 2, 1].find((d) => d * power <= most) * power;
    const words = `${Number(length.toPrecision(1))} (${Number((length / data.edge).toPrecision(2))} edges)`;
    for (const bar of grid.querySelectorAll(".scale")) {
      bar.style.width = `${length / unit}px`;
      bar.textContent = words;
    }
  };
  const redraw = () => {
    if (!asked) {
      asked = true;
      requestAnimationFrame(draw);
    }
  };

  // --- what hands do ---
  const held = new Map();
  const scale = () => {
    const shown = cells.find((c) => !c.hidden);
    return state.height / ((shown ? shown.getBoundingClientRect().height : 320) - 40);
  };
  const half = (bits) => { // a number of 16 bits
    const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, part = bits & 1023;
    return sign * (exponent ? 2 ** (exponent - 15) * (1 + part / 1024) : 2 ** -14 * (part / 1024));
  };
  // the vertex that is seen at a place of the window: of those around it the nearest one in front
  const pick = (cell, x, y) => {
    const b = cell.getBoundingClientRect(), s = scale(), t = state.turn;
    if (y < b.top + 40) return -1;
    const px = (x - (b.left + b.right) / 2) * s - state.shift[0], py = ((b.top + 40 + b.bottom) / 2 - y) * s - state.shift[1];
    const reach = Math.max(7 * s, (0.8 * data.edge) / data.extent), around = [];
    const before = meshes[data.before].places, after = meshes[cell.dataset.panel].places, p = [0, 0, 0];
    let front = -Infinity;
    for (let i = 0; i < before.length; i += 3) {
      for (let k = 0; k < 3; k++) p[k] = ((before[i + k] * (1 - state.mixed) + after[i + k] * state.mixed) / 65535) * data.size[k] - data.middle[k];
      const dx = t[0] * p[0] + t[1] * p[1] + t[2] * p[2] - px, dy = t[3] * p[0] + t[4] * p[1] + t[5] * p[2] - py;
      if (dx * dx + dy * dy > reach * reach) continue;
      const z = t[6] * p[0] + t[7] * p[1] + t[8] * p[2];
      around.push([i / 3, dx * dx + dy * dy, z]);
      if (z > front) front = z;
    }
    let [found, least] = [-1, Infinity];
    for (const [i, far, z] of around) if (z > front - 3 * reach && far < least) [found, least] = [i, far];
    return found;
  };
  const words = (cell, x, y) => {
    const i = pick(cell, x, y);
    if (i < 0) return "";
    const lines = Object.entries(meshes[cell.dataset.panel].halves).map(
      ([key, values]) => `${data.scales[key].label}: ${Number(half(values[i]).toPrecision(3))} ${data.scales[key].unit}`);
    return [data.whole ? `vertex ${i}` : "a vertex", ...lines].join("\n");
  };
  let pointed = null;
  grid.addEventListener("pointermove", (e) => {
    if (held.size) {
      pointed = null;
      return quiet();
    }
    const cell = e.target.closest(".cell");
    if (!pointed) requestAnimationFrame(() => {
      if (pointed) say(pointed.cell ? words(pointed.cell, pointed.e.clientX, pointed.e.clientY) : "", pointed.e);
      pointed = null;
    });
    pointed = { cell, e };
  });
  grid.addEventListener("pointerleave", () => { pointed = null; quiet(); });
  const zoom = (factor) => {
    const next = Math.min(Math.max(state.height * factor, data.height / 200), data.height * 4);
    state.height = next;
    redraw();
  };
  grid.addEventListener("contextmenu", (e) => e.preventDefault());
  grid.addEventListener("pointerdown", (e) => {
    grid.setPointerCapture(e.pointerId);
    held.set(e.pointerId, [e.clientX, e.clientY]);
  });
  grid.addEventListener("pointermove", (e) => {
    const last = held.get(e.pointerId);
    if (!last) return;
    const [dx, dy] = [e.clientX - last[0], e.clientY - last[1]];
    if (held.size === 2) { // two fingers
      const other = [...held.entries()].find(([id]) => id !== e.pointerId)[1];
      const far = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
      zoom(far(last) / Math.max(far([e.clientX, e.clientY]), 1));
    } else if (e.shiftKey || e.buttons & 6) {
      state.shift = [state.shift[0] + dx * scale(), state.shift[1] - dy * scale()];
    } else state.turn = product(about(dy * 0.008, dx * 0.008), state.turn);
    held.set(e.pointerId, [e.clientX, e.clientY]);
    redraw();
  });
  for (const end of ["pointerup", "pointercancel"]) grid.addEventListener(end, (e) => held.delete(e.pointerId));
  grid.addEventListener("wheel", (e) => {
    e.preventDefault();
    zoom(Math.exp(Math.max(-0.5, Math.min(0.5, e.deltaY * 0.0015))));
  }, { passive: false });

  const byId = (id) => document.getElementById(id);
  const mix = byId("mix"), flip = byId("flip");
  const setMixed = (value) => {
    state.mixed = value;
    mix.value = 100 * value;
    flip.setAttribute("aria-pressed", String(value < 0.5));
    redraw();
  };
  mix.addEventListener("input", () => setMixed(mix.value / 100));
  flip.addEventListener("click", () => setMixed(state.mixed < 0.5 ? 1 : 0));
  byId("reset").addEventListener("click", () => { Object.assign(state, whole()); redraw(); });
  byId("close").addEventListener("click", () => {
    const fresh = whole(), p = data.close, t = fresh.turn;
    const seen = [0, 1].map((r) => p[0] * t[3 * r] + p[1] * t[3 * r + 1] + p[2] * t[3 * r + 2]);
    Object.assign(state, { turn: t, shift: [-seen[0], -seen[1]], height: data.height / 4 });
    redraw();
  });
  byId("color").addEventListener("change", (e) => setColor(e.target.value));
  const setColor = (key) => {
    state.color = key;
    byId("legend").hidden = !key;
    if (key) {
      const { low, high, unit, ramp: text } = data.scales[key], rgb = bytes(text);
      byId("low").textContent = Number(low.toPrecision(2));
      byId("high").textContent = Number(high.toPrecision(2));
      byId("unit").textContent = unit;
      const drawn = byId("ramp").getContext("2d"), image = drawn.createImageData(256, 12);
      for (let i = 0; i < 256 * 12; i++) image.data.set([...rgb.slice(3 * (i % 256), 3 * (i % 256) + 3), 255], 4 * i);
      drawn.putImageData(image, 0, 0);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, rgb);
    }
    redraw();
  };
  for (const box of document.querySelectorAll(".chips input")) {
    box.addEventListener("change", () => { cells[box.dataset.panel].hidden = !box.checked; redraw(); });
  }
  canvas.addEventListener("webglcontextlost", () => document.body.classList.add("no-webgl"));
  new ResizeObserver(redraw).observe(grid);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  window.specsmooth = { state, draw, pick };
  redraw();
})();

"use strict";
// Solids that move: drawn with WebGL, or, where there is none, sorted by distance on a plain canvas.
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const canvas = document.getElementById("view");
  const parts = data.parts.map((p) => {
    const counting = p.bytes === 2 ? Uint16Array : Uint32Array;
    const points = Float32Array.from(decode(p.points, Uint16Array), (v, k) => p.low[k % 3] + v * p.step[k % 3]);
    // four bytes a normal, as WebGL likes them
    const short = decode(p.normals, Int8Array), normals = new Int8Array(short.length / 3 * 4);
    for (let k = 0; k < short.length; k++) normals[k + Math.floor(k / 3)] = short[k];
    const ends = decode(p.ends, counting), edges = new Float32Array(3 * ends.length);
    ends.forEach((end, k) => { for (let r = 0; r < 3; r++) edges[3 * k + r] = points[3 * end + r]; });
    return {
      name: p.name, colour: p.colour, opacity: p.opacity, visible: true, points, normals, ends, edges,
      index: Uint32Array.from(decode(p.index, counting)), poses: decode(p.poses, Float32Array),
      bend: p.shapes && {
        shapes: decode(p.shapes, Float32Array), coordinates: decode(p.coordinates, Float32Array),
        start: Float32Array.from(points), frame: -1,
      },
    };
  });
  // Points, normals and edges of a part that bends, at an instant; whether they are others than before.
  function deflect(p, frame) {
    const b = p.bend;
    if (!b || b.frame === frame) return false;
    b.frame = frame;
    const size = b.start.length, count = b.shapes.length / size;
    p.points.set(b.start);
    for (let k = 0; k < count; k++) {
      const q = b.coordinates[frame * count + k];
      for (let i = 0; i < size; i++) p.points[i] += q * b.shapes[k * size + i];
    }
    const sum = new Float32Array(size), at = p.points, n = p.normals;
    for (let t = 0; t < p.index.length; t += 3) {
      const [i, j, k] = [3 * p.index[t], 3 * p.index[t + 1], 3 * p.index[t + 2]];
      const u = [0, 1, 2].map((r) => at[j + r] - at[i + r]), v = [0, 1, 2].map((r) => at[k + r] - at[i + r]), w = cross(u, v);
      for (const m of [i, j, k]) for (let r = 0; r < 3; r++) sum[m + r] += w[r];
    }
    for (let m = 0; m < size / 3; m++) {
      const length = Math.hypot(sum[3 * m], sum[3 * m + 1], sum[3 * m + 2]);
      if (length > 0) for (let r = 0; r < 3; r++) n[4 * m + r] = Math.round(127 * sum[3 * m + r] / length);
    }
    p.ends.forEach((end, k) => { for (let r = 0; r < 3; r++) p.edges[3 * k + r] = at[3 * end + r]; });
    return true;
  }
  const up = data.up;
  let azimuth = data.azimuth * Math.PI / 180, elevation = data.elevation * Math.PI / 180;
  let zoom = 1, panX = 0, panY = 0, current = 0;

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const n = Math.hypot(a[0], a[1], a[2]); return a.map((v) => v / n); };
  const mix = (a, x, b, y) => a.map((v, k) => v * x + b[k] * y);
  const largest = up.map(Math.abs).indexOf(Math.max(...up.map(Math.abs)));
  const hint = [0, 0, 0];
  hint[(largest + 1) % 3] = 1;
  const ahead = unit(mix(hint, 1, up, -dot(hint, up))), aside = cross(up, ahead);

  // How far the view must reach for the whole scene, as first seen, to fit.
  let span = data.span;
  function fit() {
    const c = camera(), aspect = canvas.width / canvas.height;
    const across = Math.max(...data.hull.map((p) => Math.abs(dot(c.right, p))));
    const along = Math.max(...data.hull.map((p) => Math.abs(dot(c.top, p))));
    span = 2.1 * (aspect > 1 ? Math.max(across / aspect, along) : Math.max(across, along * aspect));
  }
  function camera() {
    const level = mix(ahead, Math.cos(azimuth), aside, Math.sin(azimuth));
    const right = mix(ahead, -Math.sin(azimuth), aside, Math.cos(azimuth));
    const back = mix(level, Math.cos(elevation), up, Math.sin(elevation));
    return { right, top: cross(back, right), back };
  }
  // Rows of the view: x and y from -1 to 1 over the shorter side, z towards the viewer.
  function viewing() {
    const c = camera(), aspect = canvas.width / canvas.height, s = zoom * 2 / span;
    const sx = aspect > 1 ? s / aspect : s, sy = aspect > 1 ? s : s * aspect;
    return { c, sx, sy, sz: -0.5 / data.span };
  }
  // A parallel projection: returns the 4x4 matrix of a pose (three rows of axes, origin), columns first.
  function matrix(view, pose) {
    const rows = [[view.c.right, view.sx, panX], [view.c.top, view.sy, panY], [view.c.back, view.sz, 0]];
    const out = new Float32Array(16);
    rows.forEach(([axis, s, shift], r) => {
      for (let k = 0; k < 3; k++) out[4 * k + r] = s * (axis[0] * pose[k] + axis[1] * pose[3 + k] + axis[2] * pose[6 + k]);
      out[12 + r] = s * (axis[0] * (pose[9] - data.centre[0]) + axis[1] * (pose[10] - data.centre[1]) +
        axis[2] * (pose[11] - data.centre[2])) + shift;
    });
    out[15] = 1;
    return out;
  }
  function turning(view, pose) {
    const out = new Float32Array(9), axes = [view.c.right, view.c.top, view.c.back];
    for (let r = 0; r < 3; r++)
      for (let k = 0; k < 3; k++)
        out[3 * k + r] = axes[r][0] * pose[k] + axes[r][1] * pose[3 + k] + axes[r][2] * pose[6 + k];
    return out;
  }
  const still = [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0];
  // Arrows as slim solids, a shaft and a head: corners and normals of triangles.
  function arrowSolids(frame) {
    const points = [], normals = [], sides = 10, thick = 0.006 * data.span;
    for (const [x, y, z, fx, fy, fz] of data.forces[frame] || []) {
      const start = [x, y, z], n = Math.hypot(fx, fy, fz);
      if (n === 0) continue;
      const d = [fx / n, fy / n, fz / n], p = unit(cross(d, Math.abs(d[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0])), q = cross(d, p);
      const head = Math.min(5 * thick, 0.6 * n);
      const at = (along, radius, k) => {
        const turn = 2 * Math.PI * k / sides, out = mix(p, Math.cos(turn), q, Math.sin(turn));
        return [mix(mix(start, 1, d, along), 1, out, radius), out];
      };
      for (let k = 0; k < sides; k++)
        for (const [from, wide, to, narrow] of [[0, thick, n - head, thick], [n - head, 2.4 * thick, n, 0]]) {
          const [a, na] = at(from, wide, k), [b, nb] = at(from, wide, k + 1), [c] = at(to, narrow, k), [e] = at(to, narrow, k + 1);
          points.push(...a, ...b, ...e, ...a, ...e, ...c);
          normals.push(...na, ...nb, ...nb, ...na, ...nb, ...na);
        }
    }
    return [new Float32Array(points), new Float32Array(normals)];
  }
  // For the plain canvas: shafts and strokes of heads.
  function arrowLines(frame) {
    const out = [];
    for (const [x, y, z, fx, fy, fz] of data.forces[frame] || []) {
      const a = [x, y, z], f = [fx, fy, fz], b = mix(a, 1, f, 1), n = Math.hypot(fx, fy, fz);
      if (n === 0) continue;
      out.push(...a, ...b);
      const d = f.map((v) => v / n), p = unit(cross(d, Math.abs(d[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0])), q = cross(d, p);
      for (const [u, v] of [[p, 1], [p, -1], [q, 1], [q, -1]])
        out.push(...b, ...mix(mix(b, 1, d, -0.22 * n), 1, u, 0.09 * n * v));
    }
    return out;
  }

  const VERTEX = `attribute vec3 point; attribute vec3 normal; uniform mat4 place; uniform mat3 turn; uniform float lift;
    varying vec3 facing; void main() { facing = turn * normal; gl_Position = place * vec4(point, 1.0);
    gl_Position.z -= lift; }`;
  const FRAGMENT = `precision mediump float; varying vec3 facing; uniform vec3 colour; uniform float lit; uniform float opacity;
    void main() { vec3 n = normalize(facing);
    float bright = 0.5 + 0.5 * max(dot(n, vec3(-0.45, 0.65, 0.61)), 0.0) + 0.2 * max(dot(n, vec3(0.7, 0.1, 0.7)), 0.0)
      + 0.18 * pow(max(dot(n, vec3(-0.25, 0.36, 0.9)), 0.0), 24.0);
    gl_FragColor = vec4(min(colour * mix(1.0, bright, lit), 1.0), opacity); }`;

  function makeWebGL() {
    const gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
    if (!gl || !gl.getExtension("OES_element_index_uint")) return null;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    const at = {};
    for (const name of ["place", "turn", "colour", "lit", "lift", "opacity"]) at[name] = gl.getUniformLocation(program, name);
    const point = gl.getAttribLocation(program, "point"), normal = gl.getAttribLocation(program, "normal");
    const buffer = (kind, values) => {
      const b = gl.createBuffer();
      gl.bindBuffer(kind, b);
      gl.bufferData(kind, values, gl.STATIC_DRAW);
      return b;
    };
    for (const p of parts) {
      p.gl = { points: buffer(gl.ARRAY_BUFFER, p.points), normals: buffer(gl.ARRAY_BUFFER, p.normals),
        index: buffer(gl.ELEMENT_ARRAY_BUFFER, p.index), edges: buffer(gl.ARRAY_BUFFER, p.edges) };
    }
    const lines = data.lines.map((l) => ({ ...l, buffer: buffer(gl.ARRAY_BUFFER, new Float32Array(l.ends)) }));
    const arrowPoints = gl.createBuffer(), arrowNormals = gl.createBuffer();
    gl.enableVertexAttribArray(point);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    function refill(buf, values) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buf);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    }
    function strokes(buf, count, colour, lift) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buf);
      gl.vertexAttribPointer(point, 3, gl.FLOAT, false, 0, 0);
      gl.disableVertexAttribArray(normal);
      gl.vertexAttrib3f(normal, 0, 0, 1);
      gl.uniform3fv(at.colour, colour);
      gl.uniform1f(at.lit, 0);
      gl.uniform1f(at.lift, lift);
      gl.drawArrays(gl.LINES, 0, count);
    }
    return (frame) => {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(1, 1, 1, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const view = viewing();
      // what is seen through comes last, over what it does not hide
      for (const p of [...parts].sort((one, two) => two.opacity - one.opacity)) {
        if (!p.visible) continue;
        if (deflect(p, frame)) {
          refill(p.gl.points, p.points);
          refill(p.gl.normals, p.normals);
          refill(p.gl.edges, p.edges);
        }
        const pose = p.poses.subarray(12 * frame, 12 * frame + 12);
        gl.uniformMatrix4fv(at.place, false, matrix(view, pose));
        gl.uniformMatrix3fv(at.turn, false, turning(view, pose));
        gl.bindBuffer(gl.ARRAY_BUFFER, p.gl.points);
        gl.vertexAttribPointer(point, 3, gl.FLOAT, false, 0, 0);
        gl.enableVertexAttribArray(normal);
        gl.bindBuffer(gl.ARRAY_BUFFER, p.gl.normals);
        gl.vertexAttribPointer(normal, 3, gl.BYTE, true, 4, 0);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, p.gl.index);
        gl.uniform3fv(at.colour, p.colour);
        gl.uniform1f(at.lit, 1);
        gl.uniform1f(at.lift, 0);
        gl.uniform1f(at.opacity, p.opacity);
        if (p.opacity < 1) { gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA); gl.depthMask(false); }
        gl.drawElements(gl.TRIANGLES, p.index.length, gl.UNSIGNED_INT, 0);
        gl.uniform1f(at.opacity, 1);
        gl.disable(gl.BLEND);
        strokes(p.gl.edges, p.edges.length / 3, p.colour.map((v) => 0.3 * v), 0.0004);
        gl.depthMask(true);
      }
      gl.uniformMatrix4fv(at.place, false, matrix(view, still));
      for (const l of lines) strokes(l.buffer, l.ends.length / 3, l.colour, 0);
      const [points, normals] = arrowSolids(frame);
      if (points.length === 0) return;
      gl.uniformMatrix3fv(at.turn, false, turning(view, still));
      gl.bindBuffer(gl.ARRAY_BUFFER, arrowPoints);
      gl.bufferData(gl.ARRAY_BUFFER, points, gl.DYNAMIC_DRAW);
      gl.vertexAttribPointer(point, 3, gl.FLOAT, false, 0, 0);
      gl.enableVertexAttribArray(normal);
      gl.bindBuffer(gl.ARRAY_BUFFER, arrowNormals);
      gl.bufferData(gl.ARRAY_BUFFER, normals, gl.DYNAMIC_DRAW);
      gl.vertexAttribPointer(normal, 3, gl.FLOAT, false, 0, 0);
      gl.uniform3fv(at.colour, [0.835, 0.369, 0]);
      gl.uniform1f(at.lit, 1);
      gl.clear(gl.DEPTH_BUFFER_BIT); // forces are never hidden by the solids they act on
      gl.drawArrays(gl.TRIANGLES, 0, points.length / 3);
    };
  }

  function makePlain() {
    const pen = canvas.getContext("2d");
    return (frame) => {
      const w = canvas.width, h = canvas.height, view = viewing(), faces = [];
      const X = (x) => (1 + x) * w / 2, Y = (y) => (1 - y) * h / 2;
      pen.fillStyle = "#fff";
      pen.fillRect(0, 0, w, h);
      for (const p of parts) {
        if (!p.visible) continue;
        deflect(p, frame);
        const m = matrix(view, p.poses.subarray(12 * frame, 12 * frame + 12)), n = p.points.length / 3;
        const seen = new Float32Array(3 * n);
        for (let k = 0; k < n; k++)
          for (let r = 0; r < 3; r++)
            seen[3 * k + r] = m[r] * p.points[3 * k] + m[4 + r] * p.points[3 * k + 1] + m[8 + r] * p.points[3 * k + 2] + m[12 + r];
        const turn = turning(view, p.poses.subarray(12 * frame, 12 * frame + 12));
        for (let k = 0; k < p.index.length; k += 3) {
          const a = 3 * p.index[k], b = 3 * p.index[k + 1], c = 3 * p.index[k + 2];
          const area = (seen[b] - seen[a]) * (seen[c + 1] - seen[a + 1]) - (seen[c] - seen[a]) * (seen[b + 1] - seen[a + 1]);
          if (area <= 0) continue;
          const q = 4 * p.index[k], v = [p.normals[q] / 127, p.normals[q + 1] / 127, p.normals[q + 2] / 127];
          const f = [0, 1, 2].map((r) => turn[r] * v[0] + turn[3 + r] * v[1] + turn[6 + r] * v[2]);
          const bright = 0.5 + 0.5 * Math.max(-0.45 * f[0] + 0.65 * f[1] + 0.61 * f[2], 0) + 0.2 * Math.max(0.7 * f[0] + 0.1 * f[1] + 0.7 * f[2], 0);
          faces.push([seen[a + 2] + seen[b + 2] + seen[c + 2], seen, a, b, c,
            "rgba(" + p.colour.map((x) => Math.min(255, Math.round(255 * x * bright))).join(",") + "," + p.opacity + ")"]);
        }
      }
      faces.sort((one, two) => two[0] - one[0]);
      for (const [, s, a, b, c, colour] of faces) {
        pen.fillStyle = pen.strokeStyle = colour;
        pen.beginPath();
        pen.moveTo(X(s[a]), Y(s[a + 1]));
        pen.lineTo(X(s[b]), Y(s[b + 1]));
        pen.lineTo(X(s[c]), Y(s[c + 1]));
        pen.closePath();
        pen.fill();
        pen.stroke();
      }
      const m = matrix(view, still);
      const stroke = (ends, colour, width) => {
        pen.strokeStyle = colour;
        pen.lineWidth = width;
        pen.beginPath();
        for (let k = 0; k < ends.length; k += 3) {
          const at = [0, 1].map((r) => m[r] * ends[k] + m[4 + r] * ends[k + 1] + m[8 + r] * ends[k + 2] + m[12 + r]);
          if (k % 6 === 0) pen.moveTo(X(at[0]), Y(at[1])); else pen.lineTo(X(at[0]), Y(at[1]));
        }
        pen.stroke();
        pen.lineWidth = 1;
      };
      for (const l of data.lines) stroke(l.ends, "rgb(" + l.colour.map((x) => Math.round(255 * x)).join(",") + ")", 1);
      stroke(arrowLines(frame), "#D55E00", 2.5);
    };
  }

  const forcePlain = new URLSearchParams(location.search).has("plain");
  let paint = forcePlain ? null : makeWebGL(), kind = "webgl";
  if (!paint) { paint = makePlain(); kind = "plain"; }
  function draw(frame) { current = frame; paint(frame); canvas.dataset.frame = frame; }

  const legend = document.getElementById("legend");
  parts.forEach((p, k) => {
    const row = document.createElement("label"), check = document.createElement("input"), chip = document.createElement("i");
    check.type = "checkbox";
    check.checked = true;
    check.onchange = () => { parts[k].visible = check.checked; draw(current); };
    chip.style.background = "rgb(" + p.colour.map((x) => Math.round(255 * x)).join(",") + ")";
    row.append(check, chip, p.name);
    legend.append(row);
  });
  document.getElementById("help").textContent = "drag: turn · shift-drag: move · wheel: zoom";
  let player = null;
  fitCanvas(canvas, () => { fit(); if (player) player.redraw(); });
  player = makePlayer(data.values, data.label, data.unit, draw);
  makePointer(canvas,
    (dx, dy, move) => {
      if (move) { panX += 2 * dx / canvas.clientWidth; panY -= 2 * dy / canvas.clientHeight; }
      else {
        azimuth -= 0.008 * dx;
        elevation = Math.max(-1.55, Math.min(1.55, elevation + 0.008 * dy));
      }
      draw(current);
    },
    (factor) => { zoom *= factor; panX *= factor; panY *= factor; draw(current); });
  document.body.dataset.ready = kind;
})();

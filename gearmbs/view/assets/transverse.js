"use strict";
// The mesh seen along the axis: outlines moved by an affine map a frame, contact points, forces, force history.
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const canvas = document.getElementById("view"), pen = canvas.getContext("2d");
  const outlines = data.wheels.map((w) => {
    const xy = decode(w.outline, Float32Array), path = new Path2D();
    for (let k = 0; k < xy.length; k += 2) path.lineTo(xy[k], xy[k + 1]);
    path.closePath();
    if (w.bore > 0) { path.moveTo(w.bore, 0); path.arc(0, 0, w.bore, 0, 2 * Math.PI, true); }
    return path;
  });
  let zoom = 1, shiftX = 0, shiftY = 0, current = 0;
  const CHART = 0.2;
  function scale() {
    const height = canvas.height * (1 - CHART);
    return { s: zoom * Math.min(canvas.width, height) / data.span, cx: canvas.width / 2 + shiftX, cy: height / 2 + shiftY };
  }
  function draw(frame) {
    current = frame;
    const { s, cx, cy } = scale(), ratio = window.devicePixelRatio || 1;
    const X = (x) => cx + (x - data.centre) * s, Y = (y) => cy - y * s;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.save();
    pen.beginPath();
    pen.rect(0, 0, canvas.width, canvas.height * (1 - CHART));
    pen.clip();
    data.wheels.forEach((wheel, k) => {
      const m = wheel.maps[frame];
      pen.save();
      pen.setTransform(s, 0, 0, -s, cx - data.centre * s, cy);
      pen.transform(m[0], m[1], m[2], m[3], m[4], m[5]);
      pen.fillStyle = wheel.fill;
      pen.fill(outlines[k], "evenodd");
      pen.strokeStyle = wheel.line;
      pen.lineWidth = 1.3 * ratio / s;
      pen.stroke(outlines[k]);
      pen.strokeStyle = "#8A8F98";
      pen.lineWidth = ratio / s;
      pen.setLineDash([5 * ratio / s, 3 * ratio / s]);
      pen.beginPath();
      pen.arc(0, 0, wheel.base, 0, 2 * Math.PI);
      pen.stroke();
      pen.restore();
    });
    pen.setLineDash([8 * ratio, 3 * ratio, 2 * ratio, 3 * ratio]);
    pen.lineWidth = 1.2 * ratio;
    pen.strokeStyle = "#CC79A7";
    pen.beginPath();
    pen.moveTo(X(data.action[0]), Y(data.action[1]));
    pen.lineTo(X(data.action[2]), Y(data.action[3]));
    pen.stroke();
    pen.setLineDash([]);
    pen.fillStyle = "#D55E00";
    for (const [x, y, size] of data.points[frame]) {
      pen.beginPath();
      pen.arc(X(x), Y(y), ratio * (1.5 + 3 * size), 0, 2 * Math.PI);
      pen.fill();
    }
    pen.font = 13 * ratio + "px system-ui, sans-serif";
    for (const [x, y, fx, fy, text] of data.arrows[frame]) arrow(X(x), Y(y), fx * s, -fy * s, text, ratio);
    pen.restore();
    chart(frame, ratio);
    canvas.dataset.frame = frame;
  }
  function arrow(x, y, dx, dy, text, ratio) {
    const length = Math.hypot(dx, dy), head = Math.min(9 * ratio, 0.5 * length);
    if (length < 1) return;
    const ux = dx / length, uy = dy / length, ex = x + dx, ey = y + dy;
    pen.strokeStyle = pen.fillStyle = "#D55E00";
    pen.lineWidth = 2.2 * ratio;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(ex - head * ux, ey - head * uy);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(ex, ey);
    pen.lineTo(ex - head * (ux - 0.45 * uy), ey - head * (uy + 0.45 * ux));
    pen.lineTo(ex - head * (ux + 0.45 * uy), ey - head * (uy - 0.45 * ux));
    pen.fill();
    pen.fillStyle = "rgba(255,255,255,.8)";
    pen.fillRect(x + 8 * ratio, y + 3 * ratio, pen.measureText(text).width + 8 * ratio, 18 * ratio);
    pen.fillStyle = "#7A2E00";
    pen.fillText(text, x + 12 * ratio, y + 17 * ratio);
  }
  function chart(frame, ratio) {
    const left = 78 * ratio, right = canvas.width - 16 * ratio;
    const top = canvas.height * (1 - CHART) + 10 * ratio, bottom = canvas.height - 8 * ratio;
    const force = data.force, high = Math.max(1e-9, ...force) * 1.3, n = Math.max(1, force.length - 1);
    pen.fillStyle = "#F5F6F8";
    pen.fillRect(left, top, right - left, bottom - top);
    pen.fillStyle = "#444";
    pen.font = 12 * ratio + "px system-ui, sans-serif";
    pen.textAlign = "right";
    const tall = high >= 1000, unit = tall ? " kN" : " N", factor = tall ? 1e-3 : 1;
    pen.fillText((high * factor).toPrecision(3) + unit, left - 6 * ratio, top + 10 * ratio);
    pen.fillText("0", left - 6 * ratio, bottom);
    pen.textAlign = "left";
    pen.fillText("sum of the normal forces", left + 6 * ratio, top + 14 * ratio);
    pen.strokeStyle = "#0072B2";
    pen.lineWidth = 1.5 * ratio;
    pen.beginPath();
    force.forEach((f, k) => pen.lineTo(left + (right - left) * k / n, bottom - (bottom - top) * f / high));
    pen.stroke();
    pen.strokeStyle = "#D55E00";
    pen.beginPath();
    pen.moveTo(left + (right - left) * frame / n, top);
    pen.lineTo(left + (right - left) * frame / n, bottom);
    pen.stroke();
  }
  document.getElementById("legend").innerHTML =
    data.wheels.map((w) => `<label><i style="background:${w.fill};border:1px solid ${w.line}"></i>${w.name}</label>`).join("") +
    '<label><i style="background:#D55E00"></i>contact, force on driven</label>' +
    '<label><i style="background:#CC79A7"></i>line of action</label>';
  document.getElementById("help").textContent = "";
  let player = null;
  fitCanvas(canvas, () => { if (player) player.redraw(); });
  player = makePlayer(data.values, data.label, data.unit, draw);
  makePointer(canvas,
    (dx, dy) => { const r = window.devicePixelRatio || 1; shiftX += dx * r; shiftY += dy * r; draw(current); },
    (factor) => { zoom *= factor; shiftX *= factor; shiftY *= factor; draw(current); });
  document.body.dataset.ready = "transverse";
})();

"use strict";
// Play, pause, seek: calls draw(frame) with whole frame numbers.
function makePlayer(values, label, unit, draw) {
  const el = (id) => document.getElementById(id);
  const count = values.length;
  let frame = 0, playing = count > 1, last = 0, carry = 0;
  el("controls").hidden = count < 2;
  el("seek").max = count - 1;
  function show(next) {
    frame = next;
    el("seek").value = frame;
    el("clock").textContent = label + " " + values[frame].toFixed(5) + " " + unit;
    draw(frame);
  }
  function name() { el("play").textContent = playing ? "Pause" : "Play"; }
  el("play").onclick = () => { playing = !playing; name(); };
  el("seek").oninput = (event) => { playing = false; name(); show(Number(event.target.value)); };
  function tick(now) {
    if (playing) {
      carry += Math.min(now - last, 200) * Number(el("speed").value) / 40;
      const steps = Math.floor(carry);
      carry -= steps;
      if (steps > 0) show((frame + steps) % count);
    }
    last = now;
    requestAnimationFrame(tick);
  }
  name();
  show(0);
  if (count > 1) requestAnimationFrame(tick);
  return { redraw: () => show(frame) };
}

// Keep the canvas as sharp as the screen; calls changed() after each new size.
function fitCanvas(canvas, changed) {
  const fit = () => {
    const ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
      changed();
    }
  };
  new ResizeObserver(fit).observe(canvas);
  fit();
}

function decode(text, type) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new type(bytes.buffer);
}

// Drag to turn or move, wheel to zoom.
function makePointer(canvas, onDrag, onZoom) {
  let held = null;
  canvas.onpointerdown = (event) => {
    held = { x: event.clientX, y: event.clientY, move: event.shiftKey || event.button > 0 };
    canvas.setPointerCapture(event.pointerId);
  };
  canvas.onpointermove = (event) => {
    if (!held) return;
    onDrag(event.clientX - held.x, event.clientY - held.y, held.move);
    held.x = event.clientX;
    held.y = event.clientY;
  };
  canvas.onpointerup = canvas.onpointercancel = () => { held = null; };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    onZoom(Math.exp(-0.0012 * event.deltaY), event);
  }, { passive: false });
}

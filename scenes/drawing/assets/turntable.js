"use strict";
// Draws a grasp on a canvas and turns it. As in scenes/drawing/painting.py, lines and points become parts
// with a depth of their own, and the farthest are drawn first.
(() => {
  const DISTANCE = 9000; // of the camera; lengths are thousandths of the object's radius
  const LIGHT = [-0.398, 0.697, 0.597];
  const DARKEST = 0.55;
  const PIECE = 180, DASH = 70; // of lines
  const STEP = Math.PI / 36; // of a key
  const canvas = document.querySelector(".stage canvas");
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const drawing = read("drawing");
  const shapes = [...(window.graspproofObject || read("object")), ...drawing.shapes];
  let axes = drawing.axes;
  const reach = Math.max(...shapes.flatMap((shape) => shape.role === "finger" || shape.role === "object"
    ? shape.polygons.flat().map((point) => Math.hypot(...point)) : []), 1);
  let zoom = 460 / reach; // of the canvas' width, an object radius
  const off = new Set();

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const cross = (a, b) => [
    a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const mixed = (a, b, share) => a.map((value, i) => value + share * (b[i] - value));

  function seen(point) {
    const near = dot(axes[2], point);
    const scale = DISTANCE / Math.max(DISTANCE - near, 0.1 * DISTANCE);
    return [dot(axes[0], point) * scale, dot(axes[1], point) * scale, near];
  }

  function tinted(shape, polygon, opacity) {
    let bright = 1;
    if (shape.shaded && polygon) {
      const normal = cross(minus(polygon[1], polygon[0]), minus(polygon[2], polygon[1]));
      const turned = axes.map((axis) => dot(axis, normal));
      const length = Math.hypot(...turned);
      const facing = length ? dot(turned, LIGHT) / length * Math.sign(turned[2] || 1) : 1;
      bright = DARKEST + (1 - DARKEST) * Math.max(facing, 0);
    }
    const parts = [1, 3, 5].map((at) => Math.round(bright * parseInt(shape.colour.slice(at, at + 2), 16)));
    return `rgba(${parts.join(",")},${opacity})`;
  }

  function parts() {
    const found = [];
    for (const shape of shapes) {
      if (off.has(shape.role)) continue;
      for (const polygon of shape.polygons) {
        const flat = polygon.map(seen);
        const near = flat.reduce((sum, point) => sum + point[2], 0) / flat.length;
        found.push({ near, flat, colour: tinted(shape, polygon, shape.fill) });
      }
      const colour = tinted(shape, null, shape.opacity);
      for (const line of shape.lines) {
        for (let i = 0; i + 1 < line.length; i++) {
          const count = Math.max(1, Math.round(Math.hypot(...minus(line[i + 1], line[i])) / (shape.dashed ? DASH : PIECE)));
          for (let part = 0; part < count; part += shape.dashed ? 2 : 1) {
            const flat = [part, part + 1].map((at) => seen(mixed(line[i], line[i + 1], at / count)));
            found.push({ near: 0.5 * (flat[0][2] + flat[1][2]) + 10, flat, colour, width: shape.line });
          }
        }
      }
      for (const point of shape.points) {
        const flat = [seen(point)];
        found.push({ near: flat[0][2] + 60, flat, colour, dot: shape.dot });
      }
    }
    return found.sort((a, b) => a.near - b.near);
  }

  function draw() {
    const side = canvas.clientWidth, sharp = window.devicePixelRatio || 1;
    canvas.width = canvas.height = Math.round(side * sharp);
    const pen = canvas.getContext("2d");
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.lineCap = "round";
    const scale = zoom * side / 1000;
    const place = ([x, y]) => [0.5 * side + scale * x, 0.5 * side - scale * y];
    for (const part of parts()) {
      pen.beginPath();
      if (part.dot) {
        pen.arc(...place(part.flat[0]), 0.005 * part.dot * side, 0, 2 * Math.PI);
      } else {
        part.flat.forEach((point, i) => (i ? pen.lineTo(...place(point)) : pen.moveTo(...place(point))));
      }
      if (part.width) {
        pen.strokeStyle = part.colour;
        pen.lineWidth = Math.max(0.01 * part.width * side, 0.6);
        pen.stroke();
      } else {
        pen.fillStyle = part.colour;
        pen.fill();
      }
    }
    pen.font = "bold 13px sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillStyle = "#30363d";
    drawing.numbers.forEach((point, finger) => pen.fillText(finger, ...place(seen(point))));
  }

  function turn(aside, up) {
    // About the axis through the object that points upwards on the screen, then about the one to
    // the right.
    for (const [angle, i, j] of [[aside, 2, 0], [up, 1, 2]]) {
      const c = Math.cos(angle), s = Math.sin(angle);
      const one = axes[i].map((value, k) => c * value - s * axes[j][k]);
      const two = axes[j].map((value, k) => s * axes[i][k] + c * value);
      axes = axes.map((axis, k) => (k === i ? one : k === j ? two : axis));
    }
    draw();
  }

  function larger(factor) {
    zoom = Math.min(Math.max(zoom * factor, 0.08), 3);
    draw();
  }

  const KEYS = {
    ArrowLeft: () => turn(-STEP, 0), ArrowRight: () => turn(STEP, 0),
    ArrowUp: () => turn(0, -STEP), ArrowDown: () => turn(0, STEP),
    "+": () => larger(1.15), "-": () => larger(1 / 1.15),
  };
  canvas.addEventListener("keydown", (event) => {
    if (KEYS[event.key]) {
      KEYS[event.key]();
      event.preventDefault();
    }
  });
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons & 1) turn(event.movementX / 120, event.movementY / 120);
  });
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    if (event.ctrlKey) {
      larger(Math.exp(-event.deltaY / 500));
      event.preventDefault();
    }
  }, { passive: false });

  const choices = document.querySelector(".stage .shown");
  for (const role of new Set(shapes.map((shape) => shape.role))) {
    if (role === "contact" || role === "edge") continue;
    const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: true });
    box.addEventListener("change", () => {
      if (box.checked) off.delete(role); else off.add(role);
      draw();
    });
    const label = document.createElement("label");
    label.append(box, ` ${role}`);
    choices.append(label);
  }
  window.addEventListener("resize", draw);
  draw();
})();

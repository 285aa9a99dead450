"use strict";
// Draws a grasp on a canvas and turns it. As in scenes/drawing/painting.py, lines and points become parts
// with a depth of their own, and the farthest are drawn first; smooth edges are drawn where they
// are the outline of the object.
(() => {
  const LIGHT = [-0.398, 0.697, 0.597];
  const DARKEST = 0.55;
  const PIECE = 180, DASH = 70; // of lines
  const STEP = Math.PI / 36; // of a key
  const canvas = document.querySelector(".stage canvas");
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const drawing = read("drawing");
  const shapes = [...(window.graspproofObject || read("object")), ...drawing.shapes];
  const DISTANCE = drawing.distance; // of the camera; lengths are thousandths of the object's radius
  let axes = drawing.axes;
  const SMOOTH = Math.cos(20 * Math.PI / 180); // up to this angle edges are not drawn, but outlines
  const LABEL = 11; // radius of a number's circle, in pixels
  const off = new Set(drawing.hidden);

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const cross = (a, b) => [
    a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const mixed = (a, b, share) => a.map((value, i) => value + share * (b[i] - value));

  const hypot = (point) => Math.hypot(...point);
  // All turns about the middle of what is drawn: the object's, or that of the object in a hand.
  const centred = (points) => points.map((point) => minus(point, drawing.middle));
  for (const shape of shapes) {
    shape.polygons = shape.polygons.map(centred);
    shape.lines = shape.lines.map(centred);
    shape.points = centred(shape.points);
  }
  drawing.numbers = centred(drawing.numbers);
  let farthest = 1; // what a view must hold, from whichever side
  for (const shape of shapes) {
    if ((!shape.solid && shape.role !== "object") || off.has(shape.role)) continue;
    for (const polygon of shape.polygons) {
      for (const point of polygon) farthest = Math.max(farthest, hypot(point));
    }
  }
  for (const point of drawing.numbers) farthest = Math.max(farthest, hypot(point));
  // what is nearer is larger, at most by this; the circles of numbers reach beyond their middles
  const nearer = 1 / Math.sqrt(1 - Math.min(farthest / DISTANCE, 0.9) ** 2);
  let zoom = 465 / (farthest * nearer);

  // Normals and neighbours do not change when the drawing turns.
  for (const shape of shapes) {
    shape.normals = shape.polygons.map((polygon) => {
      const normal = cross(minus(polygon[1], polygon[0]), minus(polygon[2], polygon[1]));
      const length = hypot(normal) || 1;
      return normal.map((part) => part / length);
    });
    if (shape.solid) shape.normals = outwards(shape);
    shape.folds = shape.role === "object" ? folds(shape) : [];
  }

  function outwards(shape) {
    const all = shape.polygons.flat();
    const middle = [0, 1, 2].map((i) => all.reduce((sum, point) => sum + point[i], 0) / all.length);
    return shape.normals.map((normal, place) => {
      const polygon = shape.polygons[place];
      const center = [0, 1, 2].map((i) => polygon.reduce((sum, p) => sum + p[i], 0) / polygon.length);
      return dot(normal, minus(center, middle)) < 0 ? normal.map((part) => -part) : normal;
    });
  }

  // The smooth edges of the object, each with the polygons on both sides.
  function folds(shape) {
    const open = new Map(), found = [];
    shape.polygons.forEach((polygon, place) => polygon.forEach((start, i) => {
      const end = polygon[(i + 1) % polygon.length];
      const back = `${end}|${start}`;
      if (!open.has(back)) {
        open.set(`${start}|${end}`, place);
      } else if (dot(shape.normals[place], shape.normals[open.get(back)]) > SMOOTH) {
        found.push([start, end, place, open.get(back)]);
      }
    }));
    return found;
  }

  function seen(point) {
    const near = dot(axes[2], point);
    const scale = DISTANCE / Math.max(DISTANCE - near, 0.1 * DISTANCE);
    return [dot(axes[0], point) * scale, dot(axes[1], point) * scale, near];
  }

  const ink = () => getComputedStyle(canvas).color.match(/[\d.]+/g).slice(0, 3).map(Number);

  function tinted(shape, normal, opacity) {
    let bright = 1;
    if (shape.shaded && normal) {
      const turned = axes.map((axis) => dot(axis, normal));
      bright = DARKEST + (1 - DARKEST) * Math.max(dot(turned, LIGHT) * Math.sign(turned[2] || 1), 0);
    }
    const plain = shape.role === "edge" || shape.role === "contact" ? ink()
      : [1, 3, 5].map((at) => parseInt(shape.colour.slice(at, at + 2), 16));
    return `rgba(${plain.map((part) => Math.round(bright * part)).join(",")},${opacity})`;
  }

  function hull(points) {
    const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const chain = (list) => {
      const kept = [];
      for (const p of list) {
        while (kept.length > 1) {
          const [a, b] = kept.slice(-2);
          if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
          kept.pop();
        }
        kept.push(p);
      }
      return kept.slice(0, -1);
    };
    return [...chain(sorted), ...chain(sorted.reverse())];
  }

  const mean = (flat) => flat.reduce((sum, point) => sum + point[2], 0) / flat.length;
  const faces = (shape, place) => {
    const camera = axes[2].map((part) => part * DISTANCE);
    return dot(shape.normals[place], minus(camera, shape.polygons[place][0])) > 0;
  };

  function* filled(shape) {
    if (shape.role === "force cone") { // its outline, and its open end
      const flat = shape.polygons.flat().map(seen), near = mean(flat);
      const colour = tinted(shape, null, shape.fill);
      yield { near, flat: hull(flat), colour };
      yield { near, flat: shape.polygons.map((polygon) => seen(polygon[1])), colour };
      return;
    }
    const solid = shape.solid; // its outline covers the seams between its sides
    const all = solid ? shape.polygons.flat().map(seen) : [];
    if (solid) yield { near: mean(all), flat: hull(all), colour: tinted(shape, shape.normals[0], 1) };
    for (let place = 0; place < shape.polygons.length; place++) {
      if (solid && !faces(shape, place)) continue;
      const flat = shape.polygons[place].map(seen);
      yield { near: mean(solid ? all : flat), flat, solid, colour: tinted(shape, shape.normals[place], shape.fill) };
    }
  }

  function* lines(shape) {
    const colour = tinted(shape, null, shape.opacity);
    for (const line of shape.lines) {
      for (let i = 0; i + 1 < line.length; i++) {
        const count = Math.max(1, Math.round(hypot(minus(line[i + 1], line[i])) / (shape.dashed ? DASH : PIECE)));
        for (let part = 0; part < count; part += shape.dashed ? 2 : 1) {
          const flat = [part, part + 1].map((at) => seen(mixed(line[i], line[i + 1], at / count)));
          yield { near: 0.5 * (flat[0][2] + flat[1][2]) + 10, flat, colour, width: shape.line };
        }
      }
    }
  }

  function* outline(shape) {
    const edge = shapes.find((other) => other.role === "edge") || { opacity: 0.75, line: 0.18 };
    const colour = tinted({ role: "edge" }, null, edge.opacity);
    const front = shape.folds.length ? shape.polygons.map((_, place) => faces(shape, place)) : [];
    for (const [start, end, one, two] of shape.folds) {
      if (front[one] === front[two]) continue;
      const flat = [seen(start), seen(end)];
      yield { near: 0.5 * (flat[0][2] + flat[1][2]) + 10, flat, colour, width: edge.line };
    }
  }

  function parts() {
    const found = [];
    for (const shape of shapes) {
      if (off.has(shape.role) || (shape.role === "edge" && off.has("object"))) continue;
      found.push(...filled(shape), ...lines(shape), ...outline(shape));
      for (const point of shape.points) {
        const flat = [seen(point)];
        found.push({ near: flat[0][2] + 60, flat, colour: tinted(shape, null, shape.opacity), dot: shape.dot });
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
      if (part.solid) { // without gaps between the sides of a solid
        pen.strokeStyle = part.colour;
        pen.lineWidth = 0.8;
        pen.stroke();
      }
    }
    pen.font = "bold 13px sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    const style = getComputedStyle(canvas);
    const kept = (value) => Math.min(Math.max(value, LABEL + 2), side - LABEL - 2);
    drawing.numbers.forEach((point, finger) => {
      const [x, y] = place(seen(point)).map(kept);
      pen.beginPath();
      pen.arc(x, y, LABEL, 0, 2 * Math.PI);
      pen.fillStyle = style.backgroundColor;
      pen.strokeStyle = (shapes.find((shape) => shape.finger === finger) || { colour: style.color }).colour;
      pen.lineWidth = 1.5;
      pen.fill();
      pen.stroke();
      pen.fillStyle = style.color;
      pen.fillText(finger, x, y + 1);
    });
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

  const swatch = (shape) => {
    const pattern = document.createElement("canvas");
    pattern.width = 36;
    pattern.height = 20;
    pattern.className = "swatch";
    const pen = pattern.getContext("2d");
    pen.fillStyle = pen.strokeStyle = shape.finger === null ? shape.colour : "#8a9099";
    if (shape.dot) {
      pen.arc(18, 10, 6, 0, 2 * Math.PI);
      pen.fill();
    } else if (shape.fill) {
      pen.globalAlpha = Math.max(shape.fill, 0.35);
      pen.fillRect(2, 3, 32, 14);
    } else {
      pen.lineWidth = 3;
      pen.setLineDash(shape.dashed ? [8, 5] : []);
      pen.moveTo(0, 10);
      pen.lineTo(36, 10);
      pen.stroke();
    }
    return pattern;
  };
  const choices = document.querySelector(".stage .shown");
  for (const role of new Set(shapes.map((shape) => shape.role))) {
    if (role === "contact" || role === "edge") continue;
    const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: !off.has(role) });
    box.addEventListener("change", () => {
      if (box.checked) off.delete(role); else off.add(role);
      draw();
    });
    const label = document.createElement("label");
    label.append(box, swatch(shapes.find((shape) => shape.role === role)), ` ${role}`);
    choices.append(label);
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  window.addEventListener("resize", draw);
  draw();
})();

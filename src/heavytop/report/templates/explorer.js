"use strict";
// The explorer: a state of numbers, what can be changed in it, and what is drawn of it. Whatever a
// link or a box holds is read as a number, and is put on the page as a text.
(() => {
  const DATA = JSON.parse(document.getElementById("data").textContent);
  const NAMES = ["A", "C", "gMR", "theta", "phi", "psi", "thetadot", "phidot", "mass", "gravity"]; // and spin
  const START = ["theta", "thetadot", "phi", "phidot", "psi"]; // in a scene file
  const DEGREE = Math.PI / 180, RPM = Math.PI / 30, LONG = 14, CURVE = 401;
  const KNOWN = 1e-9; // rad, of φ after a nutation
  const [COARSE, FINE] = [[48, 36], [160, 120]]; // the plane of kicks, in motion and at rest
  const IDLE = 150; // ms
  const MISSING = { gravity: 9.81 }; // m/s², where a scene has no mass; any other number is 0
  const SLOP = 8; // px, that a finger goes before it is known to go sideways
  const INK = "#222222", SOFT = "#57606A", GRID = "#E3E6EA", BLUE = "#0072B2", ORANGE = "#D55E00";
  const BARE = /^-?(0|[1-9][0-9]*)(\.[0-9]+)?([eE][-+]?[0-9]+)?$/; // a number in TOML
  const TOKEN = /(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|\*\*|[a-z]+|\S/gi;
  const THOUSANDS = /(?<![\d.])[1-9]\d{0,2}(?:,\d{3})+(?!\d)/; // or a decimal: nobody can tell
  const OPERATORS = { "+": [1, (a, b) => a + b], "-": [1, (a, b) => a - b],
    "*": [2, (a, b) => a * b], "/": [2, (a, b) => a / b],
    "^": [4, (a, b) => a ** b], "**": [4, (a, b) => a ** b] }; // and how tightly they bind
  const $ = (id) => document.getElementById(id);
  const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
  const short = (x, digits = 6) => String(Number(x.toPrecision(digits))).replace("-", "−");
  const angle = (x) => `${short(x / DEGREE, 5)}° (${short(x, 5)} rad)`;
  const calm = matchMedia("(prefers-reduced-motion: reduce)");

  // --- the state, and what it says of a top ------------------------------------------------------
  let state, ranges, play = true, held = false, due = false, shown, later;
  let placed = false; // whether the distance was given, or follows from mass and gMR
  const spinning = (top) => ({ ...top, omega3: top.held === "omega3" ? top.spin
    : top.spin + top.phidot * Math.cos(top.theta) });
  const stateOf = ({ numbers, held }) => ({
    ...Object.fromEntries(NAMES.map((name) => [name, numbers[name] ?? MISSING[name] ?? 0])), held, spin: numbers[held] });
  const rates = (top) => Math.sqrt(Math.abs(top.gMR) / top.A);
  const limit = (top) => 2 * Math.sqrt(top.A * Math.abs(top.gMR)); // of |p_ψ|, to sleep

  // What a person changes: of a state its value, and the state with another value.
  const clean = (x) => Number(x.toPrecision(15)); // a product, without the noise of its last digit
  const plain = (name) => ({ of: (s) => s[name], with: (s, x) => ({ ...s, [name]: x }) });
  const CONTROLS = {
    theta: plain("theta"), phidot: plain("phidot"), thetadot: plain("thetadot"),
    spin: plain("spin"),
    shape: { of: (s) => s.C / s.A, with: (s, ratio) => ({ ...s, C: clean(ratio * s.A) }) },
    pull: { of: (s) => s.gMR / s.A, with: (s, pull) => ({ ...s, gMR: clean(pull * s.A) }) },
    A: { of: (s) => s.A, with: (s, A) => ({ ...s, A, C: clean((s.C / s.A) * A) }) },
    mass: { of: (s) => s.mass || NaN, with: (s, mass) => // a distance that was given stays
      ({ ...s, mass, gMR: placed ? clean((s.gMR * mass) / s.mass) : s.gMR }) },
    distance: { of: (s) => s.gMR / (s.gravity * s.mass || NaN), with: (s, R) => (s.mass
      ? { ...s, gMR: clean(s.mass * s.gravity * R) } : { ...s, mass: clean(s.gMR / (s.gravity * R)) }) },
  };
  const nice = (x) => { // 1, 2 or 5 times a power of ten, not below x
    const power = 10 ** Math.floor(Math.log10(x));
    return [1, 2, 5, 10].map((m) => m * power).find((y) => y >= x * 0.999999);
  };
  const reaches = (s) => { // of the sliders, about a state
    const natural = rates(s) || 5, around = (x, least) => nice(Math.max(1.5 * Math.abs(x), least));
    const wide = { phidot: around(s.phidot, 3 * natural), thetadot: around(s.thetadot, natural),
      spin: around(s.spin, (3 * natural * s.A) / s.C), pull: around(s.gMR / s.A, 10) };
    return { theta: [0, 180], shape: [0.01, 2],
      ...Object.fromEntries(Object.entries(wide).map(([name, x]) => [name, [-x, x]])) };
  };

  // Which number of a state cannot be, and between what it has to be; or nothing.
  const wrong = (s) => {
    const values = { ...s, [s.held]: s.spin, "C/A": s.C / s.A, "gMR/A": s.gMR / s.A };
    for (const [name, [low, high]] of Object.entries(DATA.limits)) {
      const value = values[name];
      if (name in values && !(value >= low && value <= high)) return { name, low, high };
    }
    return null;
  };
  const between = ({ low, high }, scale = 1, unit = "") =>
    `from ${short(low / scale)} to ${short(high / scale)} ${unit === "deg" ? "°" : unit}`.trim();
  // A number, which may be an expression: never run as a script.
  const number = (text) => {
    const tokens = (text.length < 200 && text.match(TOKEN)) || [];
    const inside = () => {
      const value = expression(1);
      return tokens.shift() === ")" ? value : NaN;
    };
    const first = (token = "") => {
      if (token === "-" || token === "+") return (token === "-" ? -1 : 1) * expression(3);
      if (token === "pi") return Math.PI;
      if (token === "(") return inside();
      if (token === "sqrt" && tokens.shift() === "(") return Math.sqrt(inside());
      return /^[\d.]/.test(token) ? Number(token) : NaN;
    };
    const expression = (loosest) => {
      let value = first(tokens.shift());
      while (OPERATORS[tokens[0]]?.[0] >= loosest) {
        const [binds, apply] = OPERATORS[tokens.shift()];
        value = apply(value, expression(binds === 4 ? 3 : binds + 1));
      }
      return value;
    };
    const value = expression(1);
    return tokens.length ? NaN : value;
  };
  // What a box says: its text as a scene takes it, its unit, that in SI, and the value in SI.
  const typed = (text, { of: name, unit: usual }) => {
    const units = DATA.units[name] ?? {};
    const ascii = text.trim().replaceAll("−", "-").replace(/[×·]/g, "*").replaceAll("π", " pi ")
      .replaceAll("°", "deg").replaceAll("²", "^2");
    const named = Object.keys(units).sort((one, two) => two.length - one.length).find((each) =>
      ascii.endsWith(each) && !/[a-z]$/i.test(ascii.slice(0, -each.length)));
    const unit = named ?? (usual in units ? usual : ""), scale = units[unit] ?? 1;
    const body = ascii.slice(0, ascii.length - (named ?? "").length).trim();
    const decimal = body.replace(/(?<=\d),(?=\d)/g, ".");
    return { scale, unit, text: `${decimal} ${scale === 1 ? "" : unit}`.trim(),
      value: THOUSANDS.test(body) ? NaN : number(decimal) * scale };
  };

  // --- a state as a link and as a scene ----------------------------------------------------------
  const spelled = (x) => String(x === 0 ? 0 : x);
  const fragment = (s) => [...NAMES.map((name) => [name, s[name]]), [s.held, s.spin]]
    .map(([name, value]) => `${name}=${spelled(value).replace("+", "")}`).join("&");
  const ofFragment = (text) => { // over what the page begins with
    const given = new URLSearchParams(text.replace(/^#/, "")), s = stateOf(DATA.scenes[0]);
    for (const name of NAMES) if (given.has(name)) s[name] = number(given.get(name));
    for (const name of ["psidot", "omega3"]) {
      if (given.has(name)) [s.held, s.spin] = [name, number(given.get(name))];
    }
    return s;
  };
  const TEXTS = new Map(DATA.scenes.flatMap(({ numbers, texts }) =>
    Object.entries(texts).map(([name, text]) => [`${name} ${numbers[name]}`, text])));
  const toml = (s, end) => {
    const line = (name, value) => { // exact, where a shipped scene has the same double
      const text = TEXTS.get(`${name} ${value}`) ?? (name === "theta" && value === Math.PI ? "pi"
        : spelled(value));
      return `${name} = ${BARE.test(text) ? text : JSON.stringify(text)}`;
    };
    const starts = START.filter((name) => name === "theta" || s[name] !== 0);
    return ["format = 1", 'title = "A top from the explorer"', "", "[top]",
      ...["A", "C", "gMR"].map((name) => line(name, s[name])), "", "[start]",
      ...starts.map((name) => line(name, s[name])), line(s.held, s.spin), "", "[span]",
      `time = ${Number(end.toPrecision(4))}`, "", "[want]",
      'quantities = ["theta", "phi", "psi"]', ""].join("\n");
  };

  // --- the motion as the player takes it ---------------------------------------------------------
  const span = (top, kind, period) => { // how long is shown [s]
    const spin = Math.max(Math.abs(top.omega3), Math.abs(top.omega3 - top.phidot
      * Math.cos(top.theta)));
    const turns = spin ? DATA.turn / spin : Infinity;
    if (period) return Math.min(DATA.periods * period, Math.max(turns, period));
    const pace = Math.max(rates(top), Math.abs(top.phidot) / 4, Math.abs(top.thetadot) / 4);
    return Math.min(turns, pace ? LONG / pace : Infinity, 1e6) || 2;
  };
  const vector = (values, k, size) => values.subarray(size * k, size * (k + 1));
  const axisOf = ([w, x, y, z]) => [2 * (x * z + w * y), 2 * (y * z - w * x),
    1 - 2 * (x * x + y * y)];
  const happenings = (top, found, times, kind) => { // turning points, reversals and cusps
    const axes = times.map((_, k) => axisOf(vector(found.quaternion, k, 4)));
    const rows = axes.map(([ex, ey, ez], k) => {
      const [lx, ly, lz] = vector(found.momentum, k, 3);
      return [ly * ex - lx * ey, lz * (ex * ex + ey * ey) - ez * (lx * ex + ly * ey)];
    });
    const events = [], highest = top.gMR > 0 ? "theta_min" : "theta_max";
    for (let k = 1; k < rows.length; k += 1) {
      rows[k].forEach((now, which) => {
        const before = rows[k - 1][which];
        if (which && kind === "cusps") return; // φ̇ touches zero there: its sign is rounding
        if (!(before * now < 0 || (now === 0 && before !== 0))) return;
        const part = before / (before - now), mixed = axes[k].map((x, j) =>
          axes[k - 1][j] + part * (x - axes[k - 1][j]));
        const length = Math.hypot(...mixed);
        const turn = before < 0 ? "theta_min" : "theta_max"; // of θ̇ sin θ
        const name = which ? "reversal" : kind === "cusps" && turn === highest ? "cusp" : turn;
        events.push({ kind: name, t: times[k - 1] + part * (times[k] - times[k - 1]),
          axis: mixed.map((x) => x / length) });
      });
    }
    return events.slice(0, 200);
  };
  const precession = (top, period) => { // the mean rate of φ over a nutation, or none
    if (!period) return top.phidot;
    const begin = 0.31 * period; // not at a turning point, where an axis that passes a pole is on it
    const { complete, phi: [before, after] } = heavytop.motion(top, [begin, begin + period]);
    const turned = after - before;
    return complete ? (Math.abs(turned) < KNOWN ? 0 : turned) / period : null;
  };
  const NODDING = ["loops", "cusps", "waves", "through-top", "through-bottom", "planar-pendulum"];
  const computed = (s) => {
    const own = spinning(s), verdict = heavytop.classify(own, DATA), notes = [];
    const still = DATA.still.includes(verdict.kind);
    const top = still ? { ...own, thetadot: DATA.push, phidot: 0 } : own;
    if (still) {
      notes.push(`Without a push it stays as it is; here it was pushed at ${DATA.push} rad/s.`);
    }
    const creeping = verdict.kind === "separatrix" || verdict.detail === "asymptotic";
    let { ends, period } = heavytop.reach(top);
    if (creeping) {
      const vertical = top.gMR > 0 ? 0 : Math.PI;
      ends = top.gMR > 0 ? [vertical, ends[1]] : [ends[0], vertical];
      period = null;
    }
    if (verdict.kind === "uniform-precession") [ends, period] = [[top.theta, top.theta], null];
    const rate = creeping || DATA.polar.includes(verdict.kind) ? null : precession(top, period);
    const end = span(top, verdict.kind, period);
    const times = Array.from({ length: DATA.frames }, (_, k) => (end * k) / (DATA.frames - 1));
    const found = heavytop.motion(top, times);
    if (!found.complete) notes.push("It moves too fast to be followed to the end.");
    const spin = found.psi[times.length - 1] - found.psi[0];
    if (Math.abs(spin) > DATA.blurred * DATA.frames) {
      notes.push("The spin is too fast to be shown as it is.");
    }
    let most = 0;
    for (let k = 0; k < times.length; k += 1) {
      most = Math.max(most, Math.hypot(...vector(found.momentum, k, 3)));
    }
    const events = NODDING.includes(verdict.kind)
      ? happenings(top, found, times, verdict.kind) : [];
    const run = { title: "the explorer", end, spin, notes, theta: ends, events,
      shape: [own.C / own.A, Math.sign(own.gMR)],
      precession: found.phi[found.phi.length - 1] - found.phi[0],
      quaternion: Float32Array.from(found.quaternion),
      momentum: Float32Array.from(found.momentum, (x) => x / (most || 1)) };
    return { own, top, verdict, still, ends, period, rate, end, times, found, run };
  };

  // --- drawing -----------------------------------------------------------------------------------
  const ticks = ([low, high], most) => {
    const step = nice((high - low) / most || 1), first = Math.ceil(low / step - 1e-9);
    const count = Math.max(0, Math.floor(high / step + 1e-9) - first + 1);
    return Array.from({ length: count }, (_, k) => Number(((first + k) * step).toPrecision(10)));
  };
  const axes = (canvas, { x, y, names }) => {
    const fine = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    [canvas.width, canvas.height] = [Math.round(width * fine), Math.round(height * fine)];
    const pen = canvas.getContext("2d");
    pen.setTransform(fine, 0, 0, fine, 0, 0);
    Object.assign(pen, { font: "12px system-ui, sans-serif", fillStyle: SOFT, lineWidth: 1,
      strokeStyle: GRID });
    const marks = (v) => String(v).replace("-", "−"), wide = (v) => pen.measureText(marks(v)).width;
    const sorted = (range) => [...range].sort((one, two) => one - two);
    const levels = ticks(sorted(y), (height - 56) / 38);
    const last = wide(Number(x[1].toPrecision(3))) / 2; // of a number at the edge
    const box = { left: 26 + Math.max(46, ...levels.map(wide)), right: width - Math.max(12, last),
      top: 12, bottom: height - 44 };
    const X = (v) => box.left + ((v - x[0]) / (x[1] - x[0])) * (box.right - box.left);
    const Y = (v) => box.bottom - ((v - y[0]) / (y[1] - y[0])) * (box.bottom - box.top);
    const write = (text, at, up, align, base = "middle") => {
      Object.assign(pen, { textAlign: align, textBaseline: base });
      pen.fillText(text, at, up);
    };
    const middle = (box.left + box.right) / 2;
    pen.beginPath();
    for (const v of ticks(sorted(x), (box.right - box.left) / 70)) {
      pen.moveTo(X(v), box.top);
      pen.lineTo(X(v), box.bottom);
      write(marks(v), X(v), box.bottom + 6, "center", "top");
    }
    for (const v of levels) {
      pen.moveTo(box.left, Y(v));
      pen.lineTo(box.right, Y(v));
      write(marks(v), box.left - 6, Y(v), "right");
    }
    pen.stroke();
    pen.beginPath();
    pen.strokeStyle = "#9AA4AE";
    pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    pen.stroke();
    pen.fillStyle = INK;
    write(names[0], middle, height - 4, "center", "bottom");
    pen.save();
    pen.translate(10, (box.top + box.bottom) / 2);
    pen.rotate(-Math.PI / 2);
    write(names[1], 0, 0, "center");
    pen.restore();
    const inside = (draw) => {
      pen.save();
      pen.beginPath();
      pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
      pen.clip();
      draw();
      pen.restore();
    };
    const line = (points, colour, wide, dash = []) => inside(() => {
      Object.assign(pen, { strokeStyle: colour, lineWidth: wide, lineJoin: "round" });
      pen.setLineDash(dash);
      pen.beginPath();
      let down = false;
      for (const [u, v] of points) {
        if (Number.isFinite(v)) pen[down ? "lineTo" : "moveTo"](X(u), clamp(Y(v), -1e4, 1e4));
        down = Number.isFinite(v);
      }
      pen.stroke();
    });
    const dot = (u, v, colour) => {
      pen.beginPath();
      pen.arc(X(u), Y(v), 5, 0, 2 * Math.PI);
      Object.assign(pen, { fillStyle: colour, strokeStyle: "#FFFFFF", lineWidth: 1.5 });
      pen.fill();
      pen.stroke();
    };
    return { pen, X, Y, box, line, dot, write, inside };
  };

  const player = () => document.querySelector(".player").player;
  const now = () => Math.round(player().state().at);
  const drawTilt = () => {
    const { found, times, ends, end } = shown, degrees = Array.from(found.theta, (x) => x / DEGREE);
    let [low, high] = [Math.min(...degrees), Math.max(...degrees)];
    const pad = Math.max(0.08 * (high - low), 0.5);
    [low, high] = [Math.max(0, low - pad), Math.min(180, high + pad)];
    const at = now(), plot = axes($("tilt"), { x: [0, end], y: [high, low],
      names: ["time [s]", "tilt θ [°]"] });
    for (const tilt of ends) {
      plot.line([[0, tilt / DEGREE], [end, tilt / DEGREE]], "#9AA4AE", 1, [5, 4]);
    }
    plot.line(degrees.map((v, k) => [times[k], v]), "#9CC3DB", 2);
    plot.line(degrees.slice(0, at + 1).map((v, k) => [times[k], v]), BLUE, 2.4);
    plot.dot(times[at], degrees[at], BLUE);
  };
  const drawPotential = () => {
    const { top, ends, found } = shown, V = heavytop.potential(top);
    const { E_prime: energy } = heavytop.constants(top);
    const room = Math.max(0.35 * (ends[1] - ends[0]), 0.14);
    const [from, to] = [Math.max(0, ends[0] - room), Math.min(Math.PI, ends[1] + room)];
    const points = Array.from({ length: CURVE }, (_, k) => {
      const theta = from + ((to - from) * k) / (CURVE - 1);
      return [theta / DEGREE, V(theta)];
    });
    const lowest = Math.min(energy, ...points.map(([, v]) => v));
    const natural = 1e-3 * (Math.abs(top.gMR) + Math.abs(energy)) || 1e-9;
    const highest = Math.max(...points.map(([, v]) => (Number.isFinite(v) ? v : energy)));
    const height = Math.max(energy - lowest, natural);
    const high = Math.min(Math.max(highest, energy) + 0.1 * height, energy + 0.9 * height);
    const plot = axes($("potential"), { x: [from / DEGREE, to / DEGREE],
      y: [lowest - 0.15 * height, high], names: ["tilt θ [°]", "energy [J]"] });
    plot.line([[0, energy], [180, energy]], ORANGE, 1.2, [6, 4]);
    plot.line(ends.map((tilt) => [tilt / DEGREE, energy]), ORANGE, 3);
    plot.line(points, BLUE, 2.2);
    Object.assign(plot.pen, { fillStyle: ORANGE });
    plot.write("E′", plot.box.right - 6, plot.Y(energy) - 4, "right", "bottom");
    plot.dot(found.theta[now()] / DEGREE, energy, ORANGE);
  };

  // --- the plane of kicks ------------------------------------------------------------------------
  const plane = { image: document.createElement("canvas"), key: "", mesh: [0, 0] };
  const BOUNDS = [ // what is zero where a kind is a line, and whether it is one there
    ["LOOPING", "cusps", (x) => heavytop.sum("PASS_TOP", x) * heavytop.sum("PASS_BOTTOM", x) < 0],
    ["PASS_TOP", "through-top", (x) => heavytop.relative("OVER_TOP", x) > 0],
    ["PASS_BOTTOM", "through-bottom", (x) => heavytop.relative("OVER_BOTTOM", x) > 0],
    ["PULL", "uniform-precession", (x) => x.thetadot === 0]];
  const along = ([low, high], count) =>
    Array.from({ length: count }, (_, k) => low + ((high - low) * k) / (count - 1));
  const crossings = (cells, at, [columns, rows]) => { // where a function on the mesh is zero, as short lines
    const lines = [];
    for (let j = 0; j + 1 < rows; j += 1) {
      for (let i = 0; i + 1 < columns; i += 1) {
        const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        const values = corners.map(([a, b]) => cells[b * columns + a]);
        if (!values.every(Number.isFinite)) continue;
        const hits = corners.flatMap(([a, b], k) => {
          const [one, two, [c, d]] = [values[k], values[(k + 1) % 4], corners[(k + 1) % 4]];
          if (one < 0 === two < 0) return [];
          const part = one / (one - two);
          return [at(a + part * (c - a), b + part * (d - b))];
        });
        for (let k = 0; k + 1 < hits.length; k += 2) lines.push([hits[k], hits[k + 1]]);
      }
    }
    return lines;
  };
  const classifyPlane = (mesh) => { // anew only where it is another plane, or a finer mesh
    const key = JSON.stringify([state.A, state.C, state.gMR, state.theta, state.thetadot, state.held,
      ranges.phidot, ranges.spin]);
    if (key === plane.key && mesh[0] <= plane.mesh[0]) return;
    Object.assign(plane, { key, mesh });
    const [columns, rows] = mesh;
    const [kicks, spins] = [along(ranges.phidot, columns), along(ranges.spin, rows)];
    const kinds = [], fields = BOUNDS.map(() => []);
    for (const spin of spins) {
      for (const phidot of kicks) {
        const top = spinning({ ...state, phidot, spin }), x = heavytop.given(top);
        kinds.push(heavytop.classify(top, DATA).kind);
        BOUNDS.forEach(([name, , there], k) =>
          fields[k].push(there(x) ? heavytop.sum(name, x) : NaN));
      }
    }
    const flat = Math.sin(state.theta) < 1e-12 || state.gMR === 0; // one kind, and no boundaries
    const at = (i, j) => [kicks[0] + ((kicks.at(-1) - kicks[0]) * i) / (columns - 1),
      spins[0] + ((spins.at(-1) - spins[0]) * j) / (rows - 1)];
    plane.lines = flat ? [] : BOUNDS.map(([, kind], k) =>
      ({ kind, lines: crossings(fields[k], at, mesh) }));
    Object.assign(plane.image, { width: columns, height: rows });
    const pen = plane.image.getContext("2d"), pixels = pen.createImageData(columns, rows);
    kinds.forEach((kind, k) => {
      const { colour } = DATA.kinds[kind], row = rows - 1 - Math.floor(k / columns);
      const rgb = [1, 3, 5].map((from) => parseInt(colour.slice(from, from + 2), 16));
      pixels.data.set([...rgb, 255], 4 * (row * columns + (k % columns)));
    });
    pen.putImageData(pixels, 0, 0);
    const drawn = plane.lines.filter(({ lines }) => lines.length).map(({ kind }) => kind);
    const areas = new Set(kinds), label = (text, colour, height) => {
      const [item, swatch] = ["li", "span"].map((name) => document.createElement(name));
      swatch.className = "swatch";
      Object.assign(swatch.style, { background: colour, height });
      item.append(swatch, ...typeset(text));
      return item;
    };
    $("plane-legend").replaceChildren(...[...new Set([...kinds, ...drawn])].map((kind) => {
      const { label: name, colour } = DATA.kinds[kind];
      return areas.has(kind) ? label(name, colour) : label(`${name} (a line)`, colour, "3px");
    }), label("p_ψ² = 4A |gMR|: from there out a top with its weight above sleeps (dashed)", INK, "1px"));
  };
  const sign = () => (state.held === "omega3" ? "ω₃" : "ψ̇₀");
  const drawPlane = () => {
    const [x, y] = [ranges.phidot, ranges.spin];
    const plot = axes($("plane"), { x, y,
      names: ["kick φ̇₀ [rad/s]", `spin ${sign()} [rad/s]`] });
    const { pen, box, X, Y } = plot, [columns, rows] = plane.mesh;
    const outline = (colour) => {
      for (const [strokeStyle, lineWidth] of [["#FFFFFF", 4.5], [colour, 2.1]]) {
        Object.assign(pen, { strokeStyle, lineWidth }).stroke();
      }
    };
    plot.inside(() => {
      // A value of the mesh is in the middle of its cell, and the outermost are on the edges.
      const [w, h] = [(box.right - box.left) / (columns - 1), (box.bottom - box.top) / (rows - 1)];
      pen.imageSmoothingEnabled = false;
      pen.drawImage(plane.image, box.left - w / 2, box.top - h / 2, w * columns, h * rows);
      for (const { kind, lines } of plane.lines) {
        pen.beginPath();
        for (const [one, two] of lines) {
          pen.moveTo(X(one[0]), Y(one[1]));
          pen.lineTo(X(two[0]), Y(two[1]));
        }
        outline(DATA.kinds[kind].colour);
      }
    });
    const tied = state.held === "psidot" ? Math.cos(state.theta) : 0;
    for (const least of [-1, 1].map((side) => (side * limit(state)) / state.C)) {
      const points = x.map((kick) => [kick, least - tied * kick]);
      plot.line(points, "#FFFFFF", 3.5);
      plot.line(points, INK, 1.5, [6, 4]);
    }
    // This top: a ring, or where the point has left the map an arrow at its edge.
    const there = [clamp(state.phidot, ...x), clamp(state.spin, ...y)];
    const out = [state.phidot - there[0], there[1] - state.spin], inside = !out[0] && !out[1];
    pen.save();
    pen.translate(X(there[0]), Y(there[1]));
    pen.rotate(Math.atan2(...out.map(Math.sign).reverse()));
    pen.beginPath();
    if (inside) pen.arc(0, 0, 7, 0, 2 * Math.PI);
    else for (const [a, b] of [[0, 0], [-14, -9], [-14, 9], [0, 0]]) pen.lineTo(a, b);
    outline(INK);
    if (!inside) Object.assign(pen, { fillStyle: INK }).fill();
    pen.restore();
    plane.box = box;
    $("plane").setAttribute("aria-label", `The plane of kicks and spins. This top, ${named()}, is `
      + (inside ? `at a kick of ${short(state.phidot)} and a spin of ${short(state.spin)} rad/s.`
        : "outside it."));
  };

  // --- words and numbers -------------------------------------------------------------------------
  const typeset = (text) => text.split(/(p_[φψ])/).map((part, k) => {
    if (k % 2 === 0) return part;
    const span = document.createElement("span"), index = document.createElement("sub");
    index.textContent = part.slice(2);
    span.append("p", index);
    return span;
  });
  const named = () => {
    const { kind, detail } = shown.verdict;
    return DATA.kinds[kind].label + (detail ? `, ${detail}` : "");
  };
  const tell = (id, text) => { // a text that does not change is not read out again
    if ($(id).textContent !== text) $(id).textContent = text;
  };
  const asleep = ({ own, verdict: { detail } }) => { // why it sleeps, in numbers
    const [has, needs] = [own.C * own.omega3, limit(own)].map((p) => short(p * p, 5));
    const least = limit(own) / own.C, mark = { stable: ">", unstable: "<", marginal: "=" }[detail];
    return `p_ψ² = ${has} ${mark} 4A |gMR| = ${needs} kg² m⁴/s²; it `
      + `stands from ω₃ = ${short(least)} rad/s = ${short(least / RPM, 5)} rpm on`;
  };
  const describe = () => {
    const { verdict, own, ends, period, rate, still } = shown, look = DATA.kinds[verdict.kind];
    tell("kind", named());
    tell("plain", look.plain);
    $("verdict").style.setProperty("--kind", look.colour);
    const why = verdict.kind === "sleeping" ? asleep(shown) : verdict.why;
    $("reason").replaceChildren(...typeset(why));
    tell("margin", verdict.margin < 1e-9
      ? "It is nearer to another kind than this page tells apart: heavytop classify proves which it is."
      : `The least number that decides and is not 0 is ${short(verdict.margin, 3)} of its terms `
        + "(1: far from another kind).");
    const { p_phi: pPhi, p_psi: pPsi, E_prime: energy } = heavytop.constants(own);
    const psidot = own.omega3 - own.phidot * Math.cos(own.theta);
    const fast = verdict.detail === "fast", span = ends[1] - ends[0];
    const drop = 2 * Math.sin((ends[0] + ends[1]) / 2) * Math.sin(span / 2); // of cos θ
    const [round, textbook] = [rate, fast ? pPsi / (own.A * Math.cos(own.theta)) : own.gMR / pPsi]
      .map((each) => Math.abs((2 * Math.PI) / each));
    const spins = [psidot, own.omega3].map((each) => short(heavytop.settled(each,
      Math.abs(state.spin) + Math.abs(own.phidot))));
    const Q = DATA.quantities, facts = [
      ["Tilt", still ? angle(own.theta) : ends[0] === ends[1] ? angle(ends[0])
        : `${angle(ends[0])} to ${angle(ends[1])}`],
      ["Amplitude of nutation", still ? "–" : `${short(span / DEGREE, 5)}° from end to end, `
        + `${short(drop, 5)} in cos θ`],
      ["Period of nutation", still || !period ? "–" : `${short(period)} s`],
      ["One round", still || !rate ? "–" : `${short(round)} s, ${short(rate)} rad/s on average`],
      [`One round, by the textbook's ${fast ? "2πA cos θ/p_ψ" : "2π p_ψ/gMR"}`, still || !rate
        || !pPsi || !own.gMR ? "–" : `${short(textbook)} s, off by `
          + `${short(100 * (textbook / round - 1), 3)} %: it is for p_ψ² ≫ 4A |gMR|`],
      ["p_ψ²/(4A |gMR|)", own.gMR ? short((pPsi / limit(own)) ** 2, 5) : "–"],
      ["ψ̇ and ω₃ at the start", `${spins.join(" and ")} rad/s`],
      [`${Q.p_phi.symbol}, ${Q.p_psi.symbol}`, `${short(pPhi)}, ${short(pPsi)} ${Q.p_psi.unit}`],
      [Q.E_prime.symbol, `${short(energy)} ${Q.E_prime.unit}`],
      ["A, C, gMR", ["A", "C", "gMR"].map((n) => `${short(own[n])} ${Q[n].unit}`).join(", ")],
    ];
    $("facts").replaceChildren(...facts.flatMap(([name, value]) => {
      const [term, text] = ["dt", "dd"].map((each) => document.createElement(each));
      term.append(...typeset(name));
      text.append(...typeset(value));
      return [term, text];
    }));
    const nods = period ? `, with period ${short(period, 4)} s` : "";
    const between = ends[0] === ends[1] ? `at ${angle(ends[0])}`
      : `between ${angle(ends[0])} and ${angle(ends[1])}`;
    $("tilt").setAttribute("aria-label", `Tilt over ${short(shown.end, 4)} s, ${between}${nods}.`);
    $("potential").setAttribute("aria-label",
      `The effective potential over the tilt, and the energy line at E′ = ${short(energy, 4)} J; `
      + `the tilt stays ${between}.`);
  };

  // --- the controls ------------------------------------------------------------------------------
  const box = (name) => document.querySelector(`input[data-of="${name}"]`);
  const rated = (x) => `${short(x / DEGREE, 4)} °/s = ${short(x / RPM, 4)} rpm`;
  const fill = () => {
    const { own } = shown, psidot = own.omega3 - own.phidot * Math.cos(own.theta);
    const rim = Math.atan(Math.sqrt((2 * own.A - own.C) / own.C) / 2);
    const beside = { theta: `${short(own.theta, 5)} rad`, phidot: rated(own.phidot), thetadot: rated(own.thetadot),
      spin: `${short(state.spin / RPM, 5)} rpm; here ${state.held === "omega3"
        ? `ψ̇₀ = ${short(psidot, 5)}` : `ω₃ = ${short(own.omega3, 5)}`} rad/s`,
      shape: `Drawn as a disc on a stem, whose rim touches a table at a tilt of ${short(rim / DEGREE, 3)}°.` };
    for (const [name, { of }] of Object.entries(CONTROLS)) {
      const value = of(state), slider = $(`${name}-slider`), field = box(name);
      const scale = DATA.units[name]?.[field.dataset.unit] ?? 1;
      if (slider) {
        const [low, high] = ranges[name], at = value / scale;
        Object.assign(slider, { min: String(low), max: String(high), step: "any" });
        if (Number(slider.value) !== at) slider.value = String(at);
        slider.step = String(name === "theta" ? 0.5 : nice((high - low) / 500));
        slider.setAttribute("aria-valuetext", `${short(at)} ${field.nextElementSibling.textContent}`);
      }
      if (field !== document.activeElement || !field.dataset.typed) {
        field.value = value === value ? spelled(Number((value / scale).toPrecision(7))) : "";
        field.removeAttribute("aria-invalid");
        $(`${name}-fault`).textContent = "";
      }
      if (name in beside) $(name).querySelector("output").textContent = beside[name];
    }
    $("spin").querySelector("i").textContent = sign();
    document.querySelectorAll("input[name=held]").forEach((each) => {
      each.checked = each.value === state.held;
    });
  };

  // --- all of it, once before the next picture ---------------------------------------------------
  const draw = () => {
    if (!shown) return;
    drawTilt();
    drawPotential();
  };
  const update = () => {
    due = false;
    const text = `#${fragment(state)}`;
    shown = computed(state);
    fill();
    player().open(shown.run);
    describe();
    classifyPlane(COARSE);
    drawPlane();
    draw();
    clearTimeout(later);
    later = setTimeout(() => {
      classifyPlane(FINE);
      drawPlane();
      history.replaceState(null, "", text); // browsers refuse it many times a second
    }, IDLE);
    $("link").href = text;
    $("toml").textContent = toml(state, shown.end);
    $("copied").textContent = "";
    if (play && !held && !calm.matches) player().set(true);
  };
  const change = (next, whole = false) => {
    if (wrong(next)) return;
    state = next;
    $("refused").textContent = "";
    if (whole || !ranges) {
      [ranges, placed] = [reaches(state), false];
      $("parts").open = state.mass > 0; // where gMR is given there is nothing to see in it
    }
    if (!due) requestAnimationFrame(update);
    due = true;
  };
  const choose = (index) => {
    $("scene").selectedIndex = index;
    change(stateOf(DATA.scenes[index]), true);
  };
  const followLink = () => {
    if (location.hash.length < 2) return choose(0);
    if (location.hash === `#${state && fragment(state)}`) return undefined;
    const next = ofFragment(location.hash), bad = wrong(next);
    if (!bad) {
      const same = DATA.scenes.findIndex((each) => fragment(stateOf(each)) === fragment(next));
      $("scene").selectedIndex = same + 1 ? same : DATA.scenes.length;
      return change(next, true);
    }
    if (!state) choose(0);
    $("refused").textContent = `The link cannot be followed: ${bad.name} is to be ${between(bad)}.`;
    return undefined;
  };
  const own = () => { $("scene").selectedIndex = DATA.scenes.length; };

  DATA.scenes.forEach(({ name, title }) => $("scene").add(new Option(title, name)));
  $("scene").add(new Option("a top of your own", ""));
  $("scene").lastChild.disabled = true;
  $("scene").addEventListener("change", () => choose($("scene").selectedIndex));
  // Whether a pointer means what it is on. A finger does once it has gone sideways: one that goes up
  // or down scrolls the page, and changes nothing.
  const meant = (element) => {
    let from, sure = true;
    element.addEventListener("pointerdown", (event) => {
      [from, sure] = [event, event.pointerType !== "touch"];
    });
    element.addEventListener("pointermove", (event) => {
      if (sure) return;
      const [dx, dy] = ["clientX", "clientY"].map((way) => Math.abs(event[way] - from[way]));
      sure = dx > Math.max(SLOP, dy);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      element.addEventListener(end, () => { sure = true; });
    }
    return () => sure;
  };
  for (const [name, control] of Object.entries(CONTROLS)) {
    const slider = $(`${name}-slider`), sure = slider && meant(slider);
    slider?.addEventListener("input", () => {
      if (!sure()) return fill();
      own();
      const value = clamp(Number(slider.value), ...ranges[name]);
      return change(control.with(state, name === "theta" ? value * DEGREE : value));
    });
    const field = box(name);
    field.addEventListener("input", () => {
      field.dataset.typed = "yes";
      const { value, scale, unit, text } = typed(field.value, field.dataset);
      const key = { spin: state.held, shape: "C/A", pull: "gMR/A" }[name] ?? name;
      const next = control.with(state, value), bad = wrong(next);
      const units = ["", ...Object.keys(DATA.units[name] ?? {})].join(", ");
      const why = !Number.isFinite(value) ? `a number, such as −12.5 or 2*pi*25${units}`
        : !bad ? "" : bad.name === key ? between(bad, scale, unit)
          : `${bad.name} is then to be ${between(bad)}`;
      field.setAttribute("aria-invalid", String(why !== ""));
      $(`${name}-fault`).textContent = why;
      if (why) return;
      own();
      if (name === "distance") placed = true;
      if (scale === 1 || name !== "A") TEXTS.set(`${key} ${value}`, text); // as it was given
      change(next);
    });
    field.addEventListener("blur", () => {
      delete field.dataset.typed;
      fill();
    });
  }
  document.querySelectorAll("input[name=held]").forEach((each) =>
    each.addEventListener("change", () => { // the same top, said in the other way
      own();
      const top = spinning(state), omega3 = top.omega3;
      const spin = each.value === "omega3" ? omega3 : omega3 - top.phidot * Math.cos(top.theta);
      change({ ...state, held: each.value, spin });
    }));
  const pick = (event) => {
    const { left, right, top, bottom } = plane.box, at = $("plane").getBoundingClientRect();
    const part = (v, low, high) => clamp((v - low) / (high - low), 0, 1);
    const value = ([low, high], share) => Number((low + (high - low) * share).toPrecision(4));
    own();
    change({ ...state, phidot: value(ranges.phidot, part(event.clientX - at.left, left, right)),
      spin: value(ranges.spin, part(event.clientY - at.top, bottom, top)) });
  };
  const sure = meant($("plane"));
  $("plane").addEventListener("click", pick);
  $("plane").addEventListener("pointermove", (event) => {
    if (event.buttons && sure()) pick(event);
  });
  document.querySelectorAll("button[data-copy]").forEach((each) =>
    each.addEventListener("click", async () => {
      const text = each.dataset.copy === "toml" ? $("toml").textContent : $("link").href;
      try {
        await navigator.clipboard.writeText(text);
        $("copied").textContent = "Copied.";
      } catch { // where a browser forbids it, the text is marked, to be copied by hand
        getSelection().selectAllChildren($(each.dataset.copy));
        $("copied").textContent = "Marked: copy it with the keyboard.";
      }
    }));
  const root = document.querySelector(".player");
  player().tilt = (by, over) => { // the body is dragged, and at the end let go
    held = !over;
    own();
    change({ ...state, theta: clamp(state.theta + by, 0, Math.PI) });
  };
  root.addEventListener("moved", draw);
  root.querySelector("[data-do=play]").addEventListener("click", () => {
    play = player().state().playing;
  });
  root.querySelector("input[type=range]").addEventListener("input", () => { play = false; });
  new ResizeObserver(() => { if (shown) { drawPlane(); draw(); } }).observe($("plane"));
  addEventListener("hashchange", followLink);
  followLink();
  // What a program beside it may ask for.
  window.explorer = { state: () => ({ ...state }), shown: () => shown, toml: () => toml(state,
    shown.end), classify: (top) => heavytop.classify(top, DATA), settled: () => !due };
})();

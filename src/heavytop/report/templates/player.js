"use strict";
// A top in three dimensions on a plain canvas, seen from far away. Every element of class "player"
// is one: it holds its data as JSON, a canvas and controls. Colours are those of light paper; in
// the dark the style sheet inverts the canvas as it does every figure.
(() => {
  const SPIN = 9; // rad of spin in a second on the screen: slow enough to be followed
  const [SHORTEST, LONGEST] = [10, 40]; // s that playing a run takes
  const SECTORS = 36, MARKED = SECTORS / 4; // a quarter of the body is orange, so its spin is seen
  const [STEM, REACH, SIZE, THICK] = [0.03, 0.88, 0.62, 0.04]; // of the body; the sphere has 1
  const BODY = [150, 166, 181], PATCH = [236, 164, 30], LIGHT = [-0.45, 0.62, 0.64];
  const INK = "#222222", FAINT = "#9AA4AE", MOMENTUM = "#882255";
  const SPACINGS = [1, 2, 5, 10, 15, 30].map((degrees) => (degrees * Math.PI) / 180);
  const APART = 76; // px between rings, at least
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  const dark = matchMedia("(prefers-color-scheme: dark)");

  const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
  const degrees = (angle) => (angle * 180) / Math.PI;
  const times = (m, [x, y, z]) => m.map(([a, b, c]) => a * x + b * y + c * z);
  const product = (m, n) => m.map(([a, b, c]) =>
    [0, 1, 2].map((k) => a * n[0][k] + b * n[1][k] + c * n[2][k]));
  const rotation = ([w, x, y, z]) => [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
  const floats = (text) => (text instanceof Float32Array ? text
    : new Float32Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer));
  // Radii and heights of the body: a disc on a stem with the C/A of the top, where a disc without
  // thickness has it, tan = r/h; its centre of mass is over the pivot, or on the other side.
  const profile = ([ratio, side]) => {
    const wide = Math.atan2(2 * Math.sqrt(Math.min(ratio, 2)), Math.sqrt(Math.max(2 - ratio, 0)));
    const [r, h] = [SIZE * Math.max(Math.sin(wide), 0.1), SIZE * Math.cos(wide) * side];
    const foot = Math.min(0, h - THICK);
    return [[0, foot], [STEM, foot], [STEM, h - THICK], [r / 2, h - THICK], [r, h - THICK / 2],
      [r, h + THICK / 2], [r / 2, h + THICK], [STEM, h + THICK], [STEM, REACH], [0, REACH]];
  };
  const ring = (tilt) => Array.from({ length: 91 }, (_, k) => {
    const angle = (2 * Math.PI * k) / 90;
    return [Math.sin(tilt) * Math.cos(angle), Math.sin(tilt) * Math.sin(angle), Math.cos(tilt)];
  });

  // The marks of events, by the letters that matplotlib has for them; any other is a circle.
  const SHAPES = { "^": [[-1, 0.8], [1, 0.8], [0, -1]], v: [[-1, -0.8], [1, -0.8], [0, 1]],
    D: [[0, -1], [1, 0], [0, 1], [-1, 0]], s: [[-1, -1], [1, -1], [1, 1], [-1, 1]] };
  const drawMark = (pen, x, y, { marker, colour }) => {
    pen.beginPath();
    if (SHAPES[marker]) for (const [a, b] of SHAPES[marker]) pen.lineTo(x + 5 * a, y + 5 * b);
    else pen.arc(x, y, 4.5, 0, 2 * Math.PI);
    pen.closePath();
    Object.assign(pen, { fillStyle: "#FFFFFF", strokeStyle: colour, lineWidth: 1.6 });
    pen.fill();
    pen.stroke();
  };

  const start = (root) => {
    const { runs, marks, path: PATH, units } = JSON.parse(root.querySelector("script").textContent);
    const [canvas, slider, choice, told, legend] =
      ["canvas", "input", "select", "output", "ul"].map((name) => root.querySelector(name));
    const pen = canvas.getContext("2d");
    let run, at = 0, playing = false, last = 0, waiting = !calm.matches, due = false, own = false, following = false;
    let body, grip = null; // the body on the screen, and the finger that holds it
    const frame = () => Math.round(at);
    let camera;

    // --- one run: its frames, and where they are looked at from ------------------------------
    const opened = (given) => {
      const taken = (values, size) => Array.from({ length: values.length / size }, (_, k) =>
        values.subarray(size * k, size * (k + 1)));
      const turned = taken(floats(given.quaternion), 4).map(rotation), count = turned.length;
      const momentum = taken(floats(given.momentum), 3);
      const seconds = given.seconds ?? clamp(Math.abs(given.spin) / SPIN, SHORTEST, LONGEST);
      const span = Math.abs(given.end) || 1;
      return { ...given, turned, count, momentum, seconds, slow: seconds / span,
        axes: turned.map((rows) => rows.map((row) => row[2])),
        profile: profile(given.shape), digits: clamp(4 - Math.floor(Math.log10(span * units.t[1])), 0, 12) };
    };
    const view = () => { // right, up and towards the eye
      const turn = camera.turn + (following ? (run.precession * at) / (run.count - 1) : 0);
      const [s, c] = [Math.sin(turn), Math.cos(turn)];
      const [up, level] = [Math.sin(camera.lift), Math.cos(camera.lift)];
      return [[-s, c, 0], [-up * c, -up * s, level], [level * c, level * s, up]];
    };
    const look = (turn, lift, least) => { // the path, the body and the pivot fill the picture
      camera = { turn, lift, zoom: 1 };
      own = false;
      const rows = view(), seen = run.axes.map((axis) => times(rows, axis));
      const rims = run.profile.map(([r, h]) => [r * Math.cos(lift), h]); // seen from above the body may be cut off
      const ends = [0, 1].map((k) => [-1, 1].map((way) => way * seen.reduce((most, e) =>
        Math.max(most, way * e[k], ...rims.map(([r, h]) =>
          way * h * e[k] + r * Math.sqrt(Math.max(0, 1 - e[k] ** 2)))), 0)));
      [camera.wide, camera.high] = ends.map(([low, top]) => 1.25 * Math.max(top - low, least));
      const [x, y] = ends.map(([low, top]) => (low + top) / 2);
      camera.centre = [0, 1, 2].map((k) => x * rows[0][k] + y * rows[1][k]);
      changed();
    };
    const side = () => { // across the first lean, so that the tilt shows, and a little from above
      const far = ([x, y]) => Math.hypot(x, y);
      const lean = run.axes.find((axis) => far(axis) > 0.05)
        ?? run.axes.reduce((one, other) => (far(other) > far(one) ? other : one));
      const mean = run.axes.reduce((sum, axis) => sum + axis[2], 0) / run.count;
      const turn = far(lean) > 1e-3 ? Math.atan2(-lean[0], lean[1]) + 0.35 : -Math.PI / 2;
      look(turn, mean < -0.3 ? -0.12 : 0.3, 0.7);
    };
    const above = () => look(-Math.PI / 2, Math.PI / 2, 0.3);

    // --- drawing ----------------------------------------------------------------------------
    const line = (points, colour, width, { from = 0, to = points.length - 1, behind } = {}) => {
      pen.beginPath();
      for (let k = from, down = false; k <= to; k += 1) {
        const [x, y, depth] = points[k], here = behind === undefined || depth < 0 === behind;
        if (here) pen[down ? "lineTo" : "moveTo"](x, y);
        down = here;
      }
      Object.assign(pen, { strokeStyle: colour, lineWidth: width, lineJoin: "round" });
      pen.stroke();
    };
    const label = (points, text, colour, end, taken) => { // beside the outermost place in front
      const front = points.filter(([, y, depth]) =>
        depth >= -0.01 && y > 7 && y < canvas.clientHeight - 7);
      if (!front.length) return;
      const [far, y] = front.reduce((one, other) => (end * other[0] > end * one[0] ? other : one));
      pen.font = "12px sans-serif";
      const room = pen.measureText(text).width + 6;
      const x = clamp(far + 5 * end, end < 0 ? room : 0, canvas.clientWidth - (end > 0 ? room : 0));
      if (taken.some(([a, b]) => Math.abs(a - x) < room && Math.abs(b - y) < 13)) return;
      taken.push([x, y]);
      Object.assign(pen, { fillStyle: colour, textAlign: end > 0 ? "left" : "right",
        textBaseline: "middle", strokeStyle: "#FFFFFF", lineWidth: 3 });
      pen.strokeText(text, x, y);
      pen.fillText(text, x, y);
    };
    const drawBody = (rows, place) => {
      const rim = run.profile.map(([radius, height]) => Array.from({ length: SECTORS }, (_, k) => {
        const angle = (2 * Math.PI * k) / SECTORS;
        return times(rows, [radius * Math.cos(angle), radius * Math.sin(angle), height]);
      }));
      const faces = [];
      for (let i = 0; i + 1 < rim.length; i += 1) {
        for (let k = 0; k < SECTORS; k += 1) {
          const next = (k + 1) % SECTORS;
          const corners = [rim[i][k], rim[i][next], rim[i + 1][next], rim[i + 1][k]];
          const [a, b] = [[corners[2], corners[0]], [corners[3], corners[1]]].map(([p, q]) =>
            p.map((x, j) => x - q[j]));
          const normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0]];
          if (normal[2] <= 0) continue; // it faces away
          const lit = clamp(normal.reduce((sum, x, j) => sum + x * LIGHT[j], 0)
            / Math.hypot(...normal), 0, 1);
          const shade = 0.6 + 0.4 * (dark.matches ? 1 - lit : lit); // the dark inverts it
          const colour = (k < MARKED ? PATCH : BODY).map((x) => Math.round(x * shade));
          const depth = corners.reduce((sum, corner) => sum + corner[2], 0);
          faces.push({ depth, colour: `rgb(${colour})`, corners: corners.map(place) });
        }
      }
      for (const { corners, colour } of faces.sort((one, other) => one.depth - other.depth)) {
        pen.beginPath();
        for (const [x, y] of corners) pen.lineTo(x, y);
        pen.closePath();
        Object.assign(pen, { fillStyle: colour, strokeStyle: colour, lineWidth: 0.7 });
        pen.fill();
        pen.stroke();
      }
    };
    const draw = () => {
      due = false;
      if (!run) return;
      const [width, height] = [canvas.clientWidth, canvas.clientHeight];
      const fine = window.devicePixelRatio || 1;
      if (canvas.width !== Math.round(width * fine) || canvas.height !== Math.round(height * fine)) {
        [canvas.width, canvas.height] = [Math.round(width * fine), Math.round(height * fine)];
      }
      pen.setTransform(fine, 0, 0, fine, 0, 0);
      pen.clearRect(0, 0, width, height);
      const rows = view(), [left, low] = times(rows, camera.centre);
      const scale = camera.zoom * Math.min(width / camera.wide, height / camera.high);
      const place = ([x, y, depth]) =>
        [width / 2 + scale * (x - left), height / 2 - scale * (y - low), depth];
      const seen = (point) => place(times(rows, point));
      const step = SPACINGS.find((spacing) => spacing * scale > APART) ?? SPACINGS.at(-1);
      const ends = [...new Set(run.theta)];
      const tilts = Array.from({ length: Math.round(Math.PI / step) - 1 }, (_, k) => (k + 1) * step);
      const rings = tilts.map((tilt) => ({ tilt, points: ring(tilt).map(seen) }));
      const limits = ends.map((tilt, k) => ({ tilt, points: ring(tilt).map(seen),
        colour: marks[k ? "theta_max" : "theta_min"].colour,
        name: ends.length === 1 ? "θ" : k ? "greatest θ" : "least θ" }));
      const path = run.axes.map(seen), now = frame(), turned = run.turned[now];
      const axis = [0, REACH, 1].map((far) => seen(run.axes[now].map((x) => far * x)));

      const [x, y] = seen([0, 0, 0]);
      pen.beginPath();
      pen.arc(x, y, scale, 0, 2 * Math.PI);
      Object.assign(pen, { strokeStyle: FAINT, lineWidth: 1 });
      pen.stroke();
      line([[0, 0, -1], [0, 0, 1.15]].map(seen), FAINT, 1);
      body = { foot: [x, y], head: axis[1], scale };
      const half = (behind) => {
        pen.globalAlpha = behind ? 0.35 : 1;
        for (const { points } of rings) line(points, "#C9CED6", 0.8, { behind });
        for (const { points, colour } of limits) line(points, colour, 1, { behind });
        line(path, "#9CC3DB", 1.2, { from: now, behind });
        line(path, PATH, 2.4, { to: now, behind });
        for (const event of run.events) {
          const [a, b, depth] = seen(event.axis);
          if (depth < 0 === behind && marks[event.kind]) drawMark(pen, a, b, marks[event.kind]);
        }
        pen.globalAlpha = 1;
      };
      half(true);
      if (axis[2][2] < 0) line(axis, INK, 2.5);
      drawBody(product(rows, turned), place);
      if (axis[2][2] >= 0) line(axis.slice(1), INK, 2.5); // from the end of the stem
      half(false);
      const arrow = [[0, 0, 0], run.momentum[now]].map(seen);
      line(arrow, MOMENTUM, 2);
      pen.beginPath();
      pen.arc(...arrow[1].slice(0, 2), 3, 0, 2 * Math.PI);
      pen.fillStyle = MOMENTUM;
      pen.fill();
      const taken = [];
      for (const { tilt, points, name } of limits) {
        label(points, `${name} ${degrees(tilt).toFixed(1)}°`, INK, -1, taken);
      }
      for (const { tilt, points } of rings) {
        label(points, `${Math.round(degrees(tilt))}°`, "#6B7280", 1, taken);
      }
      tell();
    };
    const time = () => (run.end * frame()) / (run.count - 1);
    const tell = () => {
      const [x, y, z] = run.axes[frame()], theta = Math.atan2(Math.hypot(x, y), z);
      const near = run.events.find((event) =>
        Math.abs(event.t - time()) < 1.5 * Math.abs(run.end) / (run.count - 1) && marks[event.kind]);
      const inUnit = (value, digits, [unit, size]) => `${(value * size).toFixed(digits)} ${unit}`;
      const words = `t = ${inUnit(time(), run.digits, units.t)}, θ = ${degrees(theta).toFixed(2)}°`
        + (units.theta[0] === "deg" ? "" : ` = ${inUnit(theta, 4, units.theta)}`)
        + (near ? `: ${marks[near.kind].label}` : "");
      told.textContent = words;
      slider.value = String(at);
      slider.setAttribute("aria-valuetext", words);
      root.dispatchEvent(new Event("moved"));
    };
    const changed = () => { // drawn once before the next picture, however much has changed
      if (!due) requestAnimationFrame(draw);
      due = true;
    };

    // --- playing ----------------------------------------------------------------------------
    const button = (name) => root.querySelector(`[data-do=${name}]`);
    const set = (on) => {
      if (on && at >= run.count - 1) at = 0;
      if (on && !playing) {
        last = performance.now();
        requestAnimationFrame(tick);
      }
      playing = on;
      button("play").textContent = on ? "Pause" : "Play";
      button("play").setAttribute("aria-pressed", String(on));
    };
    const tick = (now) => {
      if (!playing) return;
      // A slow browser takes longer: it leaves out no turn of the body.
      const gone = clamp((now - last) / 1000, 0, 0.1);
      last = now;
      at = Math.min(at + (gone * (run.count - 1)) / run.seconds, run.count - 1);
      draw();
      if (at >= run.count - 1) set(false);
      else requestAnimationFrame(tick);
    };
    const to = (place) => {
      set(false);
      waiting = false;
      at = clamp(place, 0, run.count - 1);
      changed();
    };
    const zoom = (by) => {
      camera.zoom = clamp(camera.zoom * by, 0.4, 30);
      own = true;
      changed();
    };
    const turn = (dx, dy) => {
      camera.turn -= dx;
      camera.lift = clamp(camera.lift + dy, -Math.PI / 2, Math.PI / 2);
      own = true;
      changed();
    };
    const DO = {
      play: () => { waiting = false; set(!playing); },
      above, side,
      follow: () => { // the eye goes round with the mean precession
        following = !following;
        button("follow").setAttribute("aria-pressed", String(following));
        changed();
      },
      event: () => {
        const later = run.events.map((each) => (each.t / run.end) * (run.count - 1))
          .filter((frame) => frame > at + 1e-6);
        to(later.length ? Math.min(...later) : 0);
      },
    };
    const KEYS = {
      " ": DO.play, a: above, s: side, r: side, f: DO.follow, e: DO.event,
      "+": () => zoom(1.15), "=": () => zoom(1.15), "-": () => zoom(1 / 1.15),
      ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0),
      ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
      ",": () => to(Math.ceil(at) - 1), ".": () => to(Math.floor(at) + 1),
      Home: () => to(0), End: () => to(Infinity),
    };
    const choose = (index) => {
      run = opened(runs[index]);
      choice.selectedIndex = index;
      at = 0;
      slider.max = String(run.count - 1);
      const happened = Object.entries(marks).filter(([kind]) =>
        run.events.some((event) => event.kind === kind)).map(([, mark]) => mark);
      const strokes = [[PATH, "path of the axis so far"], [MOMENTUM, "angular momentum"]];
      button("event").disabled = !run.events.length;
      legend.replaceChildren(...[...strokes, ...happened].map((each) => {
        const [item, sample] = ["li", "canvas"].map((name) => document.createElement(name));
        [sample.width, sample.height] = [18, 14];
        const paper = sample.getContext("2d");
        if (each.label) drawMark(paper, 9, 7, each);
        else Object.assign(paper, { fillStyle: each[0] }).fillRect(0, 5, 18, 3);
        item.append(sample, each.label ?? each[1]);
        return item;
      }));
      const by = `${Number(Math.max(run.slow, 1 / run.slow).toPrecision(2))} times`;
      const pace = run.slow > 1.05 ? `slowed ${by}`
        : run.slow > 0.95 ? "as it is" : `${by} as fast as it is`;
      root.querySelector("p").textContent = [`Time is ${pace}.`, ...run.notes].join(" ");
      side();
    };

    const open = (given) => { // another run instead of all; a view that was chosen is kept
      const before = (own || grip !== null) && { ...camera }, mine = own;
      runs.splice(0, runs.length, given);
      choose(0);
      if (grip !== null) [camera, own] = [before, mine]; // nothing moves away from under a finger
      else if (before) {
        look(before.turn, before.lift, 0.7);
        zoom(before.zoom);
      }
    };

    runs.forEach((each, k) => choice.add(new Option(each.title, String(k))));
    choice.closest("label").hidden = runs.length < 2;
    choice.addEventListener("change", () => { choose(choice.selectedIndex); set(!calm.matches); });
    slider.addEventListener("input", () => to(Number(slider.value)));
    for (const name of Object.keys(DO)) button(name).addEventListener("click", DO[name]);
    canvas.addEventListener("keydown", (event) => {
      if (!KEYS[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      KEYS[event.key]();
    });
    // One pointer turns, two zoom. The wheel zooms once the canvas was clicked on; else the page
    // is scrolled, as it is by a finger that goes up or down.
    const fingers = new Map();
    const apart = () => {
      const [one, two] = [...fingers.values()];
      return Math.hypot(one.x - two.x, one.y - two.y);
    };
    const onBody = ({ clientX, clientY }) => { // where a page tilts it: near the line up the axis
      if (!root.player.tilt || !body) return false;
      const { left, top } = canvas.getBoundingClientRect(), [x, y] = body.foot;
      const [a, b] = [clientX - left - x, clientY - top - y];
      const [u, v] = [body.head[0] - x, body.head[1] - y];
      const part = clamp((a * u + b * v) / (u * u + v * v || 1), 0, 1);
      return Math.hypot(a - part * u, b - part * v) < 0.3 * body.scale;
    };
    canvas.addEventListener("touchstart", (event) => { // there a finger does not scroll the page
      if (event.touches.length === 1 && onBody(event.touches[0])) event.preventDefault();
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      canvas.setPointerCapture(event.pointerId);
      if (fingers.size === 1 && onBody(event)) grip = event.pointerId;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const far = fingers.size === 2 ? apart() : 0;
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (far) zoom(apart() / far);
      else if (grip === event.pointerId) {
        root.player.tilt((event.clientY - before.y) / body.scale, false);
      } else if (fingers.size === 1) {
        turn((event.clientX - before.x) / 150, (event.clientY - before.y) / 150);
      }
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => {
        fingers.delete(event.pointerId);
        if (grip !== event.pointerId) return;
        grip = null;
        root.player.tilt(0, true);
      });
    }
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      zoom(Math.exp(-event.deltaY / 500));
    }, { passive: false });
    dark.addEventListener("change", changed);
    if (runs.length) choose(0);
    new ResizeObserver(changed).observe(canvas);
    new IntersectionObserver(([{ isIntersecting: seen }]) => {
      if (seen && waiting && run) set(true);
      else if (!seen && playing) {
        waiting = true;
        set(false);
      }
    }, { threshold: 0.5 }).observe(canvas);
    // What a program beside it may ask for and do.
    root.player = { to, set, choose, open, state: () => ({ at, playing, camera: { ...camera },
      axis: run.axes[frame()], time: time(), count: run.count, profile: run.profile, body }) };
  };
  document.querySelectorAll(".player").forEach(start);
})();

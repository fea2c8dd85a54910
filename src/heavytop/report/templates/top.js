"use strict";
// The mathematics of a top in doubles: the kind of its motion, and where it is at any time. A top
// is an object of numbers: A, C, gMR, theta, phi, psi, thetadot, phidot and omega3. The rules by
// which kinds are told apart are data, in the words and in the order of the package.
const heavytop = (() => {
  const ZERO = 1e-12; // a number that small beside its terms counts as zero
  const ORDER = 22, SUBSTEPS = 4, MOST_STEPS = 20000;
  const TURNED = 0.9, PASSING = 1e-12; // rad, and the distance from a pole that is a pass

  // --- the kind, after heavytop.classification.kinds ---------------------------------------------
  const given = (top) => {
    const { A, C, gMR, theta, thetadot, phidot, omega3 } = top;
    const [s, c] = [Math.sin(theta / 2), Math.cos(theta / 2)];
    let [cos, below, above] = [c * c - s * s, 2 * s * s, 2 * c * c];
    if (below * above < ZERO * ZERO) { // on the vertical: as exactly as the package knows it
      cos = cos > 0 ? 1 : -1;
      [below, above] = [1 - cos, 1 + cos];
    }
    const sin2 = below * above, sine = Math.sqrt(sin2), pPsi = C * omega3;
    const kinetic = A * (thetadot * thetadot + phidot * phidot * sin2);
    const unspun = Math.sqrt(A * (kinetic + Math.abs(gMR)));
    return { A, C, gMR, cos, below, above, sin2, sine, thetadot, phidot, omega3, pPsi, kinetic,
      unspun, swing: Math.sqrt(A * kinetic), momentum: Math.hypot(unspun, pPsi),
      pPhi: A * phidot * sin2 + pPsi * cos };
  };

  // Of each number its terms, and what their sum is small beside (by default their sizes).
  const passed = (x, sizes, height) => sizes + x.unspun + (x.swing * x.sine) / height;
  const NUMBERS = {
    KINETIC: { terms: (x) => [x.swing], beside: (x) => x.momentum },
    THETA_RATE: { terms: (x) => [x.A * x.thetadot], beside: (x) => x.momentum },
    ACROSS_RATE: { terms: (x) => [x.A * x.phidot * x.sin2], beside: (x) => x.sine * x.momentum },
    SPIN_MOMENTUM: { terms: (x) => [x.pPsi], beside: (x) => x.momentum },
    WEIGHT: { terms: (x) => [x.A * x.gMR],
      beside: (x) => Math.sqrt(x.A * Math.abs(x.gMR)) * x.momentum },
    SINE: { terms: (x) => [x.sin2], beside: (x) => x.sine },
    HIGH: { terms: (x) => [x.gMR * x.cos] },
    PASS_TOP: { terms: (x) => [x.A * x.phidot * x.above, -x.pPsi], factor: (x) => x.below,
      beside: (x, sizes) => passed(x, sizes, x.below) },
    PASS_BOTTOM: { terms: (x) => [x.A * x.phidot * x.below, x.pPsi], factor: (x) => x.above,
      beside: (x, sizes) => passed(x, sizes, x.above) },
    OVER_TOP: { terms: (x) => [x.kinetic, -2 * x.gMR * x.below] },
    OVER_BOTTOM: { terms: (x) => [x.kinetic, 2 * x.gMR * x.above] },
    PULL: { terms: (x) => [x.A * x.cos * x.phidot * x.phidot, -x.pPsi * x.phidot, x.gMR] },
    LOOPING: { terms: (x) => [x.pPsi * x.kinetic, -2 * x.gMR * x.A * x.phidot * x.sin2],
      beside: (x, sizes) =>
        sizes + Math.abs(x.pPsi) * (x.kinetic + 2 * Math.abs(x.gMR) * x.sin2) },
    SLEEPING: { terms: (x) => [x.pPsi * x.pPsi, -4 * x.A * x.gMR * x.cos] },
    FASTER: { terms: (x) => [x.cos * x.A * x.cos * x.phidot * x.phidot, -x.cos * x.gMR] },
    SLOWER: { terms: (x) => [x.cos * x.A * x.cos * x.phidot * x.phidot, x.cos * x.gMR] },
  };
  const total = (values) => values.reduce((sum, value) => sum + value, 0);
  const relative = (name, x) => { // −1 … 1
    const { terms, beside, factor } = NUMBERS[name];
    if (factor && factor(x) === 0) return 0;
    const values = terms(x), sum = total(values);
    if (sum === 0) return 0;
    const sizes = total(values.map(Math.abs));
    return sum / (beside ? beside(x, sizes) : sizes);
  };
  const sum = (name, x) => total(NUMBERS[name].terms(x));

  // The kind of a top by rules {rules, details}, and by how much the nearest other one is missed.
  const classify = (top, { rules, details }) => {
    const x = given(top), found = {};
    let margin = 1;
    const size = (name) => (found[name] ??= relative(name, x));
    const side = (names) => names.reduce((sign, name) => {
      const value = size(name);
      if (Math.abs(value) <= ZERO) return 0;
      margin = Math.min(margin, Math.abs(value));
      return sign * Math.sign(value);
    }, 1);
    for (const { kind, zeros, positive, why } of rules) {
      const largest = Math.max(0, ...zeros.map((name) => Math.abs(size(name))));
      if (largest > ZERO) margin = Math.min(margin, largest);
      else if (!positive.length || side(positive) > 0) {
        const detail = details[kind];
        const name = detail && detail.names.at(side(detail.product)); // of 0, of 1, of −1
        return { kind, detail: name ?? null, margin, why };
      }
    }
    throw new Error("the last rule fits always");
  };

  // --- the constants, and the tilts between which the axis stays ---------------------------------
  // A sum that is nothing but the rounding of terms of this size is zero.
  const settled = (value, size) => (Math.abs(value) <= 4 * Number.EPSILON * size ? 0 : value);
  const constants = (top) => {
    const x = given(top), weight = x.gMR * x.cos, spin = (x.C * x.omega3 * x.omega3) / 2;
    const [moving, pull] = [x.kinetic / 2, Math.abs(x.gMR)];
    return { E_prime: settled(moving + weight, moving + pull),
      E: settled(moving + weight + spin, moving + pull + spin), p_psi: x.pPsi,
      p_phi: settled(x.pPhi, Math.abs(x.A * x.phidot * x.sin2) + Math.abs(x.pPsi)) };
  };
  const potential = (top) => { // V(θ), the form that keeps its digits near the poles
    const x = given(top);
    const [minus, plus] = [x.below * sum("PASS_TOP", x), x.above * sum("PASS_BOTTOM", x)];
    return (theta) => {
      const [s, c] = [Math.sin(theta / 2), Math.cos(theta / 2)];
      const swirl = (minus * c) / (2 * s || 1) + (plus * s) / (2 * c || 1);
      const open = minus === 0 && s === 0 ? 0 : s === 0 || c === 0 ? (minus || plus ? Infinity : 0)
        : (swirl * swirl) / (2 * x.A);
      return open + x.gMR * Math.cos(theta);
    };
  };

  // The ends of the nutation as tilts, and its period; none where nothing nutates, on a separatrix.
  // With w = 1 − cos θ seen from the pole where the weight is highest, ẇ² = f(w) is a cubic with
  // roots w₃ ≤ 0 ≤ w₂ ≤ w₁. No digits are lost beside that pole: f is made of what is small there,
  // and of the other two roots, whose product is known, none is a difference. What stays low is seen
  // from the other pole, for the same reason; there w₃ ≥ 2.
  const reach = (top) => {
    const x = given(top), low = x.kinetic + 2 * x.gMR * x.cos < -Math.abs(x.gMR);
    const up = (x.gMR >= 0) !== low;
    const start = up ? x.below : x.above;
    const pass = sum(up ? "PASS_TOP" : "PASS_BOTTOM", x) / x.A;
    const over = sum(up ? "OVER_TOP" : "OVER_BOTTOM", x) / x.A; // 2 (E′ ∓ gMR)/A
    const [pull, spin] = [2 * x.gMR, x.pPsi].map((each) => (up ? each : -each) / x.A);
    const P = start * pass; // (p_φ ∓ p_ψ)/A
    const f = (w) => (over + pull * w) * w * (2 - w) - (P + spin * w) ** 2;
    const linear = 2 * over - 2 * P * spin;
    const tilt = (w) => {
      if (w === start) return top.theta;
      const [near, far] = [Math.sqrt(w), Math.sqrt(Math.max(0, 2 - w))];
      return 2 * (up ? Math.atan2(near, far) : Math.atan2(far, near));
    };
    const turning = () => { // the root between the pole and the start
      if (P === 0 && linear > 0) return 0;
      let [outside, inside] = [0, start];
      for (;;) {
        const middle = (inside + outside) / 2;
        if (!(middle > outside && middle < inside)) return middle;
        if (f(middle) > 0) inside = middle;
        else outside = middle;
      }
    };
    const end = x.thetadot === 0 || x.sine === 0 ? start : turning();
    // f = (end − w)(pull w² − h w − c): the quadratic's other zeros have opposite signs.
    const h = 2 * pull - over - spin * spin - pull * end;
    const c = end > 0 ? P ** 2 / end : linear;
    const big = -(h + (h < 0 ? -1 : 1) * Math.sqrt(h * h + 4 * pull * c)) / 2;
    const [other, third] = h < 0 ? [c / big, big] : [-big / (pull || 1), (-pull * c) / (big || 1)];
    if (!(Math.abs(other - end) > 16 * Number.EPSILON * Math.max(other, end))) {
      return { ends: [tilt(end), tilt(end)], period: null };
    }
    const ends = [tilt(end), tilt(Math.min(2, other))].sort((one, two) => one - two);
    // f = (w₁ − w)(w − w₂)(pull w + third): the period by the arithmetic–geometric mean.
    let [a, b] = [end, other].map((w) => Math.sqrt(pull * w + third));
    if (!(Math.min(a, b) > 0)) return { ends, period: null };
    for (let k = 0; k < 12; k += 1) [a, b] = [(a + b) / 2, Math.sqrt(a * b)];
    return { ends, period: (2 * Math.PI) / a };
  };

  // --- the motion: Taylor series of q′ = ½ l q, l′ = (gMR/A)(−e_y, e_x, 0) -----------------------
  // The quaternion is freed from the uniform spin κ; e = q z q* is the axis and l = L/A. With
  // α = q₀ + i q₃ and β = q₁ + i q₂, φ = arg α + arg β and ψ = arg α − arg β + κ t.
  const begin = (top) => {
    const { A, C, theta, phi, psi, thetadot, phidot, omega3 } = top;
    const [s, c] = [Math.sin(theta / 2), Math.cos(theta / 2)];
    const [plus, minus] = [(phi + psi) / 2, (phi - psi) / 2];
    const [sine, cos, n] = [2 * s * c, c * c - s * s, (C * omega3) / A];
    const [sin, across] = [Math.sin(phi), phidot * sine];
    const level = n * sine - across * cos; // along the horizontal part of the axis
    return { args: [plus, minus], n, kappa: omega3 - n, g: top.gMR / A,
      lz: n * cos + phidot * sine * sine,
      state: [c * Math.cos(plus), s * Math.cos(minus), s * Math.sin(minus), c * Math.sin(plus),
        level * sin + thetadot * Math.cos(phi), -level * Math.cos(phi) + thetadot * sin] };
  };
  const series = (state, lz, g, into) => { // the coefficients of one step
    const [q0, q1, q2, q3, x, y] = into;
    state.forEach((value, k) => { into[k][0] = value; });
    for (let k = 0; k < ORDER; k += 1) {
      let [a, b, c, d, ex, ey] = [0, 0, 0, 0, 0, 0];
      for (let j = 0; j <= k; j += 1) {
        const i = k - j;
        a += x[j] * q1[i] + y[j] * q2[i];
        b += x[j] * q0[i] + y[j] * q3[i];
        c += y[j] * q0[i] - x[j] * q3[i];
        d += x[j] * q2[i] - y[j] * q1[i];
        ex += q1[j] * q3[i] + q0[j] * q2[i];
        ey += q2[j] * q3[i] - q0[j] * q1[i];
      }
      const half = 0.5 / (k + 1), whole = (2 * g) / (k + 1);
      q0[k + 1] = half * (-a - lz * q3[k]);
      q1[k + 1] = half * (b - lz * q2[k]);
      q2[k + 1] = half * (c + lz * q1[k]);
      q3[k + 1] = half * (d + lz * q0[k]);
      x[k + 1] = -whole * ey;
      y[k + 1] = whole * ex;
    }
  };
  const largest = (into, rows, k) => Math.max(...rows.map((row) => Math.abs(into[row][k])));
  const stride = (into, scale) => { // by the last two coefficients, so that what is left out is ε
    const parts = [ORDER - 1, ORDER].map((k) => Math.max(
      largest(into, [0, 1, 2, 3], k), largest(into, [4, 5], k) / scale) ** (1 / k));
    return Math.exp(-2) / Math.max(...parts);
  };
  const evaluated = (into, h) => into.map((row) => {
    let value = row[ORDER];
    for (let k = ORDER - 1; k >= 0; k -= 1) value = value * h + row[k];
    return value;
  });

  // By how much the direction of (re, im) turns between two times of a step, however near the
  // origin it passes; through it, half a turn forwards, as the package counts.
  const turning = (into, re, im, from, to, old, seen) => {
    const now = Math.atan2(seen[im], seen[re]);
    const change = now - old - 2 * Math.PI * Math.round((now - old) / (2 * Math.PI));
    if (Math.abs(change) < TURNED) return change;
    const middle = (from.h + to) / 2, there = evaluated(into, middle);
    const near = Math.max(Math.hypot(seen[re], seen[im]),
      Math.hypot(from.state[re], from.state[im])) < PASSING;
    if (near || !(middle > from.h && middle < to)) {
      return change < 0 && change < -Math.PI / 2 ? change + 2 * Math.PI : change;
    }
    const first = turning(into, re, im, from, middle, old, there);
    const rest = { h: middle, state: there };
    return first + turning(into, re, im, rest, to, old + first, seen);
  };

  // Where the top is at increasing times: θ, φ, ψ, the attitude, l, and how many steps it took.
  const motion = (top, times) => {
    const { args, n, kappa, g, lz, state: start } = begin(top);
    const into = start.map(() => new Float64Array(ORDER + 1));
    const count = times.length, last = times[count - 1] ?? 0, found = { steps: 0, n, kappa };
    for (const name of ["theta", "phi", "psi"]) found[name] = new Float64Array(count);
    found.quaternion = new Float64Array(4 * count);
    found.momentum = new Float64Array(3 * count);
    let [t, state, [alpha, beta], next] = [0, start, args, 0];
    const note = (at, [q0, q1, q2, q3, x, y]) => {
      const spun = kappa * times[at], [c, s] = [Math.cos(spun / 2), Math.sin(spun / 2)];
      found.theta[at] = 2 * Math.atan2(Math.hypot(q1, q2), Math.hypot(q0, q3));
      found.phi[at] = alpha + beta;
      found.psi[at] = alpha - beta + spun;
      found.quaternion.set([q0 * c - q3 * s, q1 * c + q2 * s, q2 * c - q1 * s, q3 * c + q0 * s],
        4 * at);
      found.momentum.set([x, y, lz], 3 * at);
    };
    while (next < count && times[next] <= 0) note(next++, state);
    const slowest = Math.sqrt(Math.abs(g)) + Math.abs(lz) + Math.abs(n);
    while (next < count && found.steps < MOST_STEPS) {
      series(state, lz, g, into);
      const scale = Math.max(slowest, Math.hypot(state[4], state[5])) || 1;
      const h = Math.min(stride(into, scale), last - t);
      let from = { h: 0, state };
      const ends = Array.from({ length: SUBSTEPS }, (_, k) => (h * (k + 1)) / SUBSTEPS);
      const on = (to) => {
        const seen = evaluated(into, to);
        alpha += turning(into, 0, 3, from, to, alpha, seen);
        beta += turning(into, 1, 2, from, to, beta, seen);
        from = { h: to, state: seen };
      };
      for (const end of ends) {
        while (next < count && times[next] - t <= end) {
          on(times[next] - t);
          note(next++, from.state);
        }
        if (end > from.h) on(end);
      }
      const size = Math.hypot(...from.state.slice(0, 4));
      state = from.state.map((value, k) => (k < 4 ? value / size : value));
      t = h === last - t ? last : t + h;
      found.steps += 1;
      if (t >= last) while (next < count) note(next++, from.state);
    }
    found.complete = next === count;
    return found;
  };

  return { given, classify, relative, sum, settled, constants, potential, reach, motion };
})();

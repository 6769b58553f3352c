(function () {
  "use strict";
  var all = JSON.parse(document.getElementById("data").textContent);
  var root = document.documentElement, drawn = [];

  function made(name, parent, text, cls) {
    var node = document.createElement(name);
    if (text !== undefined) { node.textContent = text; }
    if (cls) { node.className = cls; }
    if (parent) { parent.appendChild(node); }
    return node;
  }
  function colour(name) { return getComputedStyle(root).getPropertyValue(name).trim(); }
  function runColour(i) { return colour("--k" + (i % 8)); }
  function faint(c) { return "color-mix(in srgb, " + c + " 20%, transparent)"; }
  function shown(v) { return v === null || v === undefined || isNaN(v) ? "" : Number(v.toPrecision(4)).toString(); }
  function choose(parent, words, options, change) {
    var label = made("label", parent, words + " "), select = made("select", label);
    options.forEach(function (o, i) { made("option", select, o).value = i; });
    select.addEventListener("change", change);
    return select;
  }
  function axis(label, size) {
    return {
      label: label || undefined, labelSize: label ? 18 : 0, labelFont: "12px system-ui, sans-serif",
      font: "11px system-ui, sans-serif", size: size, gap: 3,
      stroke: function () { return colour("--soft"); },
      grid: { stroke: function () { return colour("--rule"); }, width: 1 },
      ticks: { show: false }
    };
  }
  function place(plot, box, height) {
    function fit() { plot.setSize({ width: Math.max(200, box.clientWidth), height: height }); }
    drawn.push({ plot: plot, fit: fit });
    if (window.ResizeObserver) { new ResizeObserver(fit).observe(box); }
  }
  function redraw() { drawn.forEach(function (d) { d.fit(); d.plot.redraw(false, true); }); }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  addEventListener("beforeprint", function () { root.classList.add("printing"); redraw(); });
  addEventListener("afterprint", function () { root.classList.remove("printing"); redraw(); });

  /* curves over the distance ------------------------------------------------------------------ */
  function decoded(q, points) {
    var text = atob(q.codes), bytes = new Uint8Array(text.length), i;
    for (i = 0; i < text.length; i++) { bytes[i] = text.charCodeAt(i); }
    var codes = new Uint16Array(bytes.buffer), step = (q.high - q.low) / 65534 || 0;
    return function (line) {
      var found = new Array(points), base = line * points, k, c;
      for (k = 0; k < points; k++) { c = codes[base + k]; found[k] = c === 65535 ? null : q.low + c * step; }
      return found;
    };
  }
  function shade(data) {
    return function (u) {
      var g = u.ctx, b = u.bbox;
      g.save();
      g.beginPath(); g.rect(b.left, b.top, b.width, b.height); g.clip();
      data.sections.forEach(function (s) {
        var from = u.valToPos(s.begin, "x", true), to = u.valToPos(s.end, "x", true);
        g.fillStyle = colour(s.curve ? "--curve" : "--transition");
        g.fillRect(from, b.top, to - from, b.height);
        if (s.words && to - from > 70) {
          g.fillStyle = colour("--soft"); g.font = 11 * devicePixelRatio + "px system-ui, sans-serif";
          g.textAlign = "center"; g.textBaseline = "top";
          g.fillText(s.words, 0.5 * (from + to), b.top + 3);
        }
      });
      g.restore();
    };
  }
  function limitLine(q) {
    return function (u) {
      if (q.limit === null) { return; }
      var y = u.valToPos(q.limit, "y", true), b = u.bbox, g = u.ctx;
      if (y < b.top || y > b.top + b.height) { return; }
      g.save();
      g.strokeStyle = g.fillStyle = colour("--bad"); g.lineWidth = devicePixelRatio; g.setLineDash([6, 4]);
      g.beginPath(); g.moveTo(b.left, y); g.lineTo(b.left + b.width, y); g.stroke();
      g.font = 11 * devicePixelRatio + "px system-ui, sans-serif"; g.textAlign = "right"; g.textBaseline = "bottom";
      g.fillText(q.limit_words, b.left + b.width - 4, y - 2);
      g.restore();
    };
  }
  function range(q) {
    return function (u, low, high) {
      if (low === null) { return [0, 1]; }
      low = Math.min(0, low); high = Math.max(0, high);
      if (q.limit > 0 && high > 0.5 * q.limit) { high = Math.max(high, q.limit); }
      if (q.limit < 0 && low < 0.5 * q.limit) { low = Math.min(low, q.limit); }
      var more = 0.06 * (high - low || 1);
      return [low < 0 ? low - more : low, high > 0 ? high + more : high];
    };
  }
  function curves(box, data, key) {
    var points = 2 * data.cells, width = (data.high - data.low) / data.cells, x = [], k;
    for (k = 0; k < data.cells; k++) { x.push(data.low + (k + 0.25) * width, data.low + (k + 0.75) * width); }
    var lines = data.quantities.map(function (q) { return decoded(q, points); }), plots = [];
    made("h3", box, data.track);
    var controls = made("div", box, undefined, "controls");
    var wheelset = choose(controls, "Wheelset", data.wheelsets.map(function (n, i) { return i + 1 + ": " + n; }), fill);
    var side = choose(controls, "Wheel", ["left", "right"], fill);
    var reset = made("button", controls, "Whole length");
    reset.type = "button";
    made("span", controls, "Drag over a plot to zoom all of them, double-click for the whole length.", "notes");
    var readings = made("div", box, undefined, "readings scroll"), table = made("table", readings);
    var head = made("tr", made("thead", table)), body = made("tbody", table), at = made("th", head), cells = [];
    data.quantities.forEach(function (q) { made("th", head, q.words + (q.unit ? " (" + q.unit + ")" : "")); });
    data.runs.forEach(function (name, i) {
      var row = made("tr", body), chip = made("span", made("td", row), name, "chip");
      chip.style.setProperty("--c", "var(--k" + (i % 8) + ")");
      chip.title = "show or hide";
      chip.addEventListener("click", function () {
        var off = chip.classList.toggle("off");
        plots.forEach(function (u) { u.setSeries(i + 1, { show: !off }); });
      });
      cells.push(data.quantities.map(function () { return made("td", row); }));
    });
    function line(q, run) {
      var n = data.wheelsets.length, s = q.sides === 2 ? Number(side.value) : 0;
      return (run * n + Number(wheelset.value)) * q.sides + s;
    }
    function values(i) {
      var q = data.quantities[i];
      return [x].concat(data.runs.map(function (_, r) { return lines[i](line(q, r)); }));
    }
    function told(u) {
      var idx = u.cursor.idx;
      at.textContent = idx === null || idx === undefined ? data.axis : data.axis.charAt(0) === "D" ? "s = " + x[idx].toFixed(1) + " m" : "t = " + x[idx].toFixed(2) + " s";
      cells.forEach(function (row, r) {
        row.forEach(function (cell, i) {
          cell.textContent = idx === null || idx === undefined ? "" : shown(plots[i] ? plots[i].data[r + 1][idx] : null);
        });
      });
    }
    function fill() { plots.forEach(function (u, i) { u.setData(values(i), false); u.redraw(true, true); u.setScale("x", { min: u.scales.x.min, max: u.scales.x.max }); }); }
    var grid = made("div", box, undefined, "grid");
    /* the wheel that is loaded most in the first run */
    data.quantities.forEach(function (q, i) {
      if (q.name !== "dQ_over_Q0") { return; }
      var best = 0;
      [0, 1].forEach(function (s) {
        side.value = s;
        lines[i](line(q, 0)).forEach(function (v) { if (v !== null && v > best) { best = v; side.dataset.best = s; } });
      });
      side.value = side.dataset.best || 0;
    });
    data.quantities.forEach(function (q, i) {
      var panel = made("div", grid, undefined, "panel");
      var title = made("h4", panel, q.words + (q.unit ? " (" + q.unit + ")" : "") + " ");
      if (q.sign) { made("small", title, q.sign); }
      var target = made("div", panel);
      var u = new uPlot({
        width: Math.max(200, target.clientWidth), height: 190, legend: { show: false },
        cursor: { sync: { key: key }, drag: { x: true, y: false } },
        scales: { x: { time: false }, y: { range: range(q) } },
        axes: [axis("", 22), axis("", 46)],
        series: [{}].concat(data.runs.map(function (name, r) {
          return { label: name, stroke: function () { return runColour(r); }, width: 1.4, points: { show: false } };
        })),
        hooks: { drawClear: [shade(data)], draw: [limitLine(q)], setCursor: [told] }
      }, values(i), target);
      plots.push(u);
      place(u, target, 190);
    });
    made("p", box, data.axis + ". Each pair of points is the smallest and the largest value of " + shown(width) + (data.axis.charAt(0) === "D" ? " m." : " s."), "notes");
    reset.addEventListener("click", function () { plots.forEach(function (u) { u.setScale("x", { min: data.low, max: data.high }); }); });
    told({ cursor: {} });
    box.railsimPlots = plots;
  }

  /* values of a study over what was varied ---------------------------------------------------- */
  function spread(box, data) {
    var names = Object.keys(data.parameters), keys = Object.keys(data.columns), u = null;
    var controls = made("div", box, undefined, "controls");
    function words(k) { var c = data.columns[k]; return c.words + (c.unit ? " (" + c.unit + ")" : ""); }
    var quantity = choose(controls, "Value", keys.map(words), draw);
    var over = choose(controls, "over", names, draw);
    var family = choose(controls, "a line for each", ["(all together)"].concat(names), draw);
    var numeric = names.findIndex(function (n) { return typeof data.parameters[n][0] === "number"; });
    over.value = Math.max(0, numeric);
    family.value = names.length > 1 ? (Number(over.value) === 0 ? 2 : 1) : 0;
    var target = made("div", box), note = made("p", box, "", "notes"), slot = null;
    function sorted(list) {
      return Array.from(new Set(list)).sort(function (a, b) { return typeof a === "number" ? a - b : String(a).localeCompare(String(b)); });
    }
    function draw() {
      var key = keys[quantity.value], ys = data.columns[key].values, xs = data.parameters[names[over.value]];
      var fs = Number(family.value) ? data.parameters[names[family.value - 1]] : null;
      var ticks = sorted(xs), isNumber = typeof ticks[0] === "number", fams = fs ? sorted(fs) : [""];
      var data2 = [isNumber ? ticks : ticks.map(function (_, i) { return i; })], series = [{}], bands = [], many = false;
      series[0] = { label: names[over.value], value: function (_, v) { return v === null ? "" : isNumber ? shown(v) : String(ticks[v]); } };
      fams.forEach(function (f, i) {
        var groups = ticks.map(function () { return []; });
        ys.forEach(function (y, r) {
          if (y !== null && (!fs || fs[r] === f)) { groups[ticks.indexOf(xs[r])].push(y); }
        });
        groups.forEach(function (g) { g.sort(function (a, b) { return a - b; }); many = many || g.length > 1; });
        function pick(how) { return groups.map(function (g) { return g.length ? how(g) : null; }); }
        var paint = function () {
          return fams.length <= 8 ? runColour(i) : "hsl(" + (250 - 230 * i / (fams.length - 1)) + " 65% " + (matchMedia("(prefers-color-scheme: dark)").matches && !root.classList.contains("printing") ? 65 : 40) + "%)";
        };
        var label = fs ? String(f) : "all runs", first = series.length;
        data2.push(pick(function (g) { var m = g.length >> 1; return g.length % 2 ? g[m] : 0.5 * (g[m - 1] + g[m]); }));
        data2.push(pick(function (g) { return g[0]; }), pick(function (g) { return g[g.length - 1]; }));
        var read = function (_, v) { return v === null || v === undefined ? "" : shown(v); };
        series.push({ label: label, stroke: paint, width: 1.6, points: { show: true, size: 6, fill: paint }, spanGaps: true, value: read, show: true });
        series.push({ class: "quiet", label: label + ", smallest", stroke: "transparent", width: 0, points: { show: false }, spanGaps: true, value: read });
        series.push({ class: "quiet", label: label + ", largest", stroke: "transparent", width: 0, points: { show: false }, spanGaps: true, value: read });
        bands.push({ series: [first + 2, first + 1], fill: function () { return faint(paint()); } });
      });
      if (!many) { /* one run at each point: no band to draw */
        data2 = data2.filter(function (_, i) { return i === 0 || i % 3 === 1; });
        series = series.filter(function (_, i) { return i === 0 || i % 3 === 1; });
        bands = [];
      }
      if (u) { u.destroy(); drawn.splice(drawn.indexOf(slot), 1); }
      var xAxis = axis(names[over.value] + (names[over.value] === "speed" ? " (m/s)" : ""), 24);
      if (!isNumber) {
        xAxis.splits = function () { return data2[0]; };
        xAxis.values = function (_, s) { return s.map(function (v) { return String(ticks[v] === undefined ? "" : ticks[v]); }); };
      }
      u = new uPlot({
        width: Math.max(200, target.clientWidth), height: 300, bands: bands,
        scales: { x: { time: false, range: function (_, a, b) { var m = 0.04 * (b - a || 1); return [a - m, b + m]; } } },
        axes: [xAxis, axis("", 52)], series: series, legend: { live: true }
      }, data2, target);
      place(u, target, 300);
      slot = drawn[drawn.length - 1];
      note.textContent = words(key) + (many ? ": line: median; band: smallest to largest of all other values." : ".");
    }
    draw();
  }

  document.querySelectorAll("[data-plots]").forEach(function (box) {
    var name = box.dataset.plots;
    if (name === "spread") { spread(box, all.spread); } else { curves(box, all.curves[Number(name)], "curves" + name); }
  });
})();

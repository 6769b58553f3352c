/* A study on the page: its runs as a table to sort and filter; values as families of curves, as a map
   over two parameters, as parallel coordinates. */
window.railsimStudy = function (data, tools) {
  "use strict";
  var made = tools.made, shown = tools.shown, choose = tools.choose;
  var names = Object.keys(data.parameters), keys = Object.keys(data.columns), total = data.runs.length;
  var CLASSES = 24, BINS = 8, PRINCIPAL = ["dQ_over_Q0_max", "dQ_over_Q0_min", "Y_over_Q_abs", "sum_Y_abs", "Y_abs", "T_gamma_abs"];
  /* values of analyses and of functions of the user have names of their own */
  var principal = keys.filter(function (k) { return PRINCIPAL.indexOf(k) >= 0 || !/_(abs|max|min|mid\d+)$/.test(k); });

  function words(c) { return c.words + (c.unit ? " (" + c.unit + ")" : ""); }
  function parameter(k) { return data.parameters[names[k]]; }
  function isNumber(c) { return c.values.every(function (v) { return typeof v === "number"; }); }
  function text(v, decimals) { return typeof v !== "number" ? String(v) : typeof decimals === "number" ? v.toFixed(decimals) : shown(v); }
  function compare(a, b) { return typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b)); }
  /* Classes of a parameter: its values, or ranges of equal width where there are too many. */
  function classes(c, most) {
    var values = Array.from(new Set(c.values)).sort(compare);
    if (values.length <= most || !isNumber(c)) {
      return { labels: values.map(function (v) { return text(v); }), at: values, of: function (v) { return values.indexOf(v); }, ranges: false };
    }
    var n = Math.min(most, BINS), low = values[0], width = (values[values.length - 1] - low) / n, labels = [], at = [];
    for (var k = 0; k < n; k++) {
      labels.push(shown(low + k * width) + " – " + shown(low + (k + 1) * width));
      at.push(low + (k + 0.5) * width);
    }
    return { labels: labels, at: at, ranges: true, of: function (v) { return Math.min(n - 1, Math.floor((v - low) / width)); } };
  }
  function median(g) {
    g.sort(function (a, b) { return a - b; });
    var m = g.length >> 1;
    return g.length % 2 ? g[m] : 0.5 * (g[m - 1] + g[m]);
  }
  function share(v, low, high) { return high !== low ? (v - low) / (high - low) : 0.5; }
  function rgb(name) { return [1, 3, 5].map(function (i) { return parseInt(tools.colour(name).slice(i, i + 2), 16); }); }
  function tint(s) {
    var low = rgb("--k4"), high = rgb("--bad");
    return "rgb(" + low.map(function (v, i) { return Math.round(v + s * (high[i] - v)); }) + ")";
  }
  function svg(name, parent, attributes, content) {
    var node = document.createElementNS("http://www.w3.org/2000/svg", name);
    Object.keys(attributes || {}).forEach(function (a) { node.setAttribute(a, attributes[a]); });
    if (content !== undefined) { node.textContent = content; }
    if (parent) { parent.appendChild(node); }
    return node;
  }
  function extent(values) {
    var found = values.filter(function (v) { return v !== null; });
    return [Math.min.apply(null, found), Math.max.apply(null, found)];
  }
  function least(value) { return /, smallest$/.test(value.words); }
  /* Values of the faint and of the strong end of the colours: of unloading the smallest is strong. */
  function tints(value, values) { return least(value) ? extent(values).reverse() : extent(values); }
  function scale(box, low, high) {
    var line = made("p", box, undefined, "notes scale");
    made("span", line, shown(low));
    made("i", line);
    made("span", line, shown(high));
  }

  /* families of curves ------------------------------------------------------------------------ */
  function families(box, value, over, family) {
    var x = parameter(over), groups = classes(x, CLASSES), f = family < 0 ? null : parameter(family);
    var kinds = f ? classes(f, BINS) : { labels: ["all runs"], of: function () { return 0; } };
    var numeric = isNumber(x), band = false;
    var xs = numeric ? groups.at : groups.labels.map(function (_, i) { return i; });
    var lines = [xs], series = [{ label: words(x), value: function (_, v) { return v === null ? "" : numeric ? shown(v) : groups.labels[v]; } }], bands = [];
    kinds.labels.forEach(function (label, i) {
      var found = xs.map(function () { return []; });
      value.values.forEach(function (y, r) {
        if (y !== null && (!f || kinds.of(f.values[r]) === i)) { found[groups.of(x.values[r])].push(y); }
      });
      band = band || found.some(function (g) { return g.length > 1; });
      function pick(how) { return found.map(function (g) { return g.length ? how(g) : null; }); }
      function paint() { return tools.runColour(i); }
      var read = function (_, v) { return v === null || v === undefined ? "" : shown(v); };
      var first = series.length, width = numeric ? 1.6 : 0; /* categories have no order: no line */
      lines.push(pick(median), pick(function (g) { return Math.min.apply(null, g); }), pick(function (g) { return Math.max.apply(null, g); }));
      series.push({ label: label, stroke: paint, width: width, points: { show: true, size: 7, fill: paint }, spanGaps: true, value: read });
      ["smallest", "largest"].forEach(function (kind) {
        series.push({ class: "quiet", label: label + ", " + kind, stroke: paint, width: 0, points: { show: !numeric, size: 4 }, spanGaps: true, value: read });
      });
      bands.push({ series: [first + 2, first + 1], fill: function () { return tools.faint(paint()); } });
    });
    if (!band) {
      lines = lines.filter(function (_, i) { return i === 0 || i % 3 === 1; });
      series = series.filter(function (_, i) { return i === 0 || i % 3 === 1; });
    }
    var across = tools.axis(words(x), 24);
    across.space = 80; /* between 40,000,000 and the next */
    if (!numeric) {
      across.splits = function () { return xs; };
      across.values = function (_, s) { return s.map(function (v) { return groups.labels[v] || ""; }); };
    }
    var target = made("div", box);
    tools.plot({
      height: 300, bands: band && numeric ? bands : [], series: series,
      scales: { x: { time: false, range: function (_, a, b) { var m = 0.04 * (b - a || 1); return [a - m, b + m]; } } },
      axes: [across, tools.axis(words(value), 52)], legend: { live: true }
    }, lines, target);
    return (f ? "Colour: " + words(f) + ". " : "") + (groups.ranges ? "Ranges of equal width. " : "")
      + (band ? "Median; " + (numeric ? "band" : "small points") + ": smallest to largest of all other values." : "");
  }

  /* map over two parameters ------------------------------------------------------------------- */
  function map(box, value, over, beside) {
    var x = parameter(over), y = parameter(beside), across = classes(x, CLASSES), up = classes(y, CLASSES);
    var cells = up.labels.map(function () { return across.labels.map(function () { return []; }); });
    value.values.forEach(function (v, r) { if (v !== null) { cells[up.of(y.values[r])][across.of(x.values[r])].push(v); } });
    var worse = least(value) ? Math.min : Math.max;
    var worst = cells.map(function (row) { return row.map(function (g) { return g.length ? worse.apply(null, g) : null; }); });
    var ends = tints(value, [].concat.apply([], worst)), n = across.labels.length, m = up.labels.length;
    var W = 900, left = 150, wide = (W - left) / n, high = Math.min(44, Math.max(18, 360 / m)), H = m * high + 74, above = 20;
    var picture = svg("svg", made("div", box, undefined, "scroll"), { viewBox: "0 0 " + W + " " + H, class: "study" });
    worst.forEach(function (row, j) {
      var top = above + (m - 1 - j) * high;
      svg("text", picture, { x: left - 8, y: top + 0.5 * high + 4, "text-anchor": "end" }, up.labels[j]);
      row.forEach(function (v, i) {
        if (v === null) { return; }
        var cell = svg("rect", picture, { x: left + i * wide, y: top, width: wide - 1, height: high - 1 });
        cell.style.fill = tint(share(v, ends[0], ends[1]));
        svg("title", cell, {}, across.labels[i] + ", " + up.labels[j] + ": " + shown(v) + " in " + cells[j][i].length + " runs");
        if (n <= 14) { svg("text", picture, { x: left + (i + 0.5) * wide, y: top + 0.5 * high + 4, "text-anchor": "middle", class: "cell" }, text(v, value.decimals)); }
      });
    });
    across.labels.forEach(function (label, i) {
      if (n <= 14 || i % Math.ceil(n / 12) === 0) { svg("text", picture, { x: left + (i + 0.5) * wide, y: above + m * high + 18, "text-anchor": "middle" }, label); }
    });
    svg("text", picture, { x: left + 0.5 * (W - left), y: above + m * high + 42, "text-anchor": "middle" }, words(x));
    svg("text", picture, { x: 4, y: 12 }, words(y));
    scale(box, ends[0], ends[1]);
    return "Colour: " + (least(value) ? "smallest " : "largest ") + words(value) + " of all runs of a cell; empty cells have no run.";
  }

  /* parallel coordinates ---------------------------------------------------------------------- */
  function parallel(box, value) {
    var axes = names.slice(0, 7).map(function (_, k) { return parameter(k); }).concat([value]);
    var W = 900, H = 320, top = 40, bottom = 24, step = (W - 160) / Math.max(1, axes.length - 1), ends = tints(value, value.values);
    var picture = svg("svg", made("div", box, undefined, "scroll"), { viewBox: "0 0 " + W + " " + H, class: "study" });
    var marks = []; /* written over the lines */
    var places = axes.map(function (c, k) {
      var x = 80 + k * step, numeric = c === value || isNumber(c), found = numeric ? null : classes(c, Infinity);
      var range = numeric ? extent(c.values) : [0, found.labels.length - 1];
      function y(v) { return H - bottom - share(numeric ? v : found.of(v), range[0], range[1]) * (H - top - bottom); }
      svg("line", picture, { x1: x, x2: x, y1: top, y2: H - bottom, class: "axis" });
      svg("text", picture, { x: x, y: 14 + 14 * (k % 2), "text-anchor": k === axes.length - 1 ? "end" : "middle" }, words(c));
      (numeric ? range : c.values.filter(function (v, i, all) { return all.indexOf(v) === i; })).forEach(function (v) {
        marks.push([{ x: x + 5, y: y(v) + 4, class: "mark" }, text(v)]);
      });
      return function (r) { return c.values[r] === null ? null : [x, y(c.values[r])]; };
    });
    data.runs.forEach(function (run, r) {
      if (value.values[r] === null) { return; }
      var points = places.map(function (place) { return place(r); });
      var line = svg("polyline", picture, { points: points.join(" ") });
      line.style.stroke = tint(share(value.values[r], ends[0], ends[1]));
      svg("title", line, {}, run.name + ": " + shown(value.values[r]));
    });
    marks.forEach(function (m) { svg("text", picture, m[0], m[1]); });
    return "One line for each run, coloured by " + words(value) + "; its name at the pointer.";
  }

  function views(box) {
    var controls = made("div", box, undefined, "controls");
    var view = choose(controls, "View", ["curves", "map", "parallel coordinates"], draw);
    var quantity = choose(controls, "Value", keys.map(function (k) { return words(data.columns[k]); }), draw);
    var labels = names.map(function (_, k) { return words(parameter(k)); });
    var over = choose(controls, "over", labels, draw);
    var family = choose(controls, "and", ["(all together)"].concat(labels), draw);
    var note, body;
    tools.exports(controls, function () { return body; }, function () { return data.columns[keys[quantity.value]].words; });
    quantity.value = Math.max(0, keys.indexOf(PRINCIPAL[0]));
    var first = names.findIndex(function (_, k) { return isNumber(parameter(k)); });
    over.value = Math.max(0, first);
    family.value = names.length > 1 ? (Number(over.value) === 0 ? 2 : 1) : 0;
    body = made("div", box, undefined, "picture");
    body.setAttribute("role", "img");
    note = made("p", box, "", "notes");
    function draw() {
      var value = data.columns[keys[quantity.value]], kind = Number(view.value), second = Number(family.value) - 1;
      over.parentNode.hidden = family.parentNode.hidden = kind === 2;
      if (body.firstChild) { body.removeChild(body.firstChild); }
      var inner = made("div", body);
      body.setAttribute("aria-label", words(value) + " of the runs");
      if (kind === 2) { note.textContent = parallel(inner, value); }
      else if (kind === 0) { note.textContent = families(inner, value, Number(over.value), second); }
      else if (second < 0) { note.textContent = "A map needs a second parameter."; }
      else { note.textContent = map(inner, value, Number(over.value), second); }
      var early = data.runs.filter(function (run, r) { return run.status !== "complete" && value.values[r] !== null; }).length;
      if (early) { note.textContent += " " + early + " of " + total + " runs ended early: their values until then."; }
    }
    draw();
  }

  /* table of all runs ------------------------------------------------------------------------- */
  function runs(box) {
    var columns = [{ words: "run", values: data.runs.map(function (r) { return r.name; }) }]
      .concat(names.map(function (_, k) { return parameter(k); }))
      .concat(keys.filter(function (k, i) { return principal.length ? principal.indexOf(k) >= 0 : i < 6; }).map(function (k) { return data.columns[k]; }))
      .concat([{ words: "status", values: data.runs.map(function (r) { return r.status; }) }]);
    var controls = made("div", box, undefined, "controls"), by = 0, falling = false, order = data.runs.map(function (_, i) { return i; });
    var label = made("label", controls, "Filter "), filter = made("input", label), count = made("span", controls, "", "notes");
    filter.type = "search";
    filter.placeholder = "words of a row";
    var table = made("table", made("div", box, undefined, "scroll runs")), head = made("tr", made("thead", table)), body = made("tbody", table);
    var command = made("p", box, "", "notes command");
    columns.forEach(function (c, k) {
      var button = made("button", made("th", head), words(c));
      button.type = "button";
      button.addEventListener("click", function () { falling = by === k ? !falling : typeof c.values[0] === "number"; by = k; draw(); });
    });
    function row(r) { return columns.map(function (c) { return c.values[r] === null ? "" : text(c.values[r], c.decimals); }); }
    function kind(c) { return c.values.some(function (v) { return typeof v === "string"; }) ? "words" : undefined; }
    function draw() {
      var wanted = filter.value.toLowerCase().split(/\s+/), found;
      order.sort(function (a, b) {
        var u = columns[by].values[a], v = columns[by].values[b];
        if (u === null || v === null) { return (u === null) - (v === null); }
        return (falling ? -1 : 1) * compare(u, v);
      });
      found = order.filter(function (r) {
        var line = row(r).join(" ").toLowerCase();
        return wanted.every(function (w) { return line.indexOf(w) >= 0; });
      });
      body.textContent = "";
      found.forEach(function (r) {
        var line = made("tr", body, undefined, data.runs[r].status === "complete" ? "" : "failed");
        row(r).forEach(function (cell, k) { made("td", line, cell, kind(columns[k])); });
        line.addEventListener("click", function () { command.textContent = [data.runs[r].reason, data.runs[r].command].filter(Boolean).join(" — "); });
      });
      count.textContent = found.length === total ? total + " runs" : found.length + " of " + total + " runs";
      Array.from(head.children).forEach(function (th, k) { th.className = [kind(columns[k]), k === by ? (falling ? "falling" : "rising") : ""].join(" "); });
    }
    filter.addEventListener("input", draw);
    made("p", box, "Click a heading to sort, a row for its reason and, in a study, its command.", "notes");
    draw();
  }
  return { spread: views, runs: runs };
};

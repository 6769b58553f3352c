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
  function redraw() { drawn = drawn.filter(function (d) { return d.plot.root.isConnected; }); drawn.forEach(function (d) { d.fit(); d.plot.redraw(false, true); }); }
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
    var keep = made("button", controls, "Save picture");
    keep.type = "button";
    keep.addEventListener("click", function () { save(grid, data.track); });
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

  /* pictures to keep ---------------------------------------------------------------------------- */
  function kept(url, name) {
    var link = made("a");
    link.href = url;
    link.download = name;
    link.click();
  }
  function save(box, name) {
    var file = name.replace(/[^A-Za-z0-9]+/g, "_"), picture = box.querySelector("svg");
    if (picture) {
      var copy = picture.cloneNode(true), style = getComputedStyle(root), marks = ["--ink", "--soft", "--rule", "--bad", "--k4"];
      copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
      marks.forEach(function (n) { copy.style.setProperty(n, style.getPropertyValue(n)); });
      copy.insertBefore(made("style", null, "text{font:12px sans-serif;fill:var(--soft)}polyline{fill:none;stroke-width:1.2px}.axis{stroke:var(--soft)}"), copy.firstChild);
      kept("data:image/svg+xml," + encodeURIComponent(new XMLSerializer().serializeToString(copy)), file + ".svg");
    } else {
      var canvases = Array.from(box.querySelectorAll("canvas")), sheet = made("canvas"), y = 0;
      sheet.width = Math.max.apply(null, canvases.map(function (c) { return c.width; }));
      sheet.height = canvases.reduce(function (h, c) { return h + c.height + 24; }, 0);
      var g = sheet.getContext("2d");
      g.fillStyle = colour("--paper"); g.fillRect(0, 0, sheet.width, sheet.height);
      canvases.forEach(function (c) {
        var panel = c.closest(".panel"), title = panel ? panel.querySelector("h4").textContent : name;
        g.fillStyle = colour("--ink"); g.font = "14px system-ui, sans-serif"; g.fillText(title, 8, y + 17);
        g.drawImage(c, 0, y + 24);
        y += c.height + 24;
      });
      kept(sheet.toDataURL("image/png"), file + ".png");
    }
  }
  function plot(options, values, target) {
    options.width = Math.max(200, target.clientWidth);
    place(new uPlot(options, values, target), target, options.height);
  }
  var study = all.spread && railsimStudy(all.spread, {
    made: made, shown: shown, choose: choose, colour: colour, runColour: runColour, faint: faint, axis: axis, plot: plot, save: save
  });

  document.querySelectorAll("[data-plots]").forEach(function (box) {
    var name = box.dataset.plots;
    if (study && study[name]) { study[name](box); } else { curves(box, all.curves[Number(name)], "curves" + name); }
  });
})();

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
  function rough(v) { return Number(v.toPrecision(2)).toString(); }
  function shown(v) { return v === null || v === undefined || isNaN(v) ? "" : Number(v.toPrecision(4)).toString(); }
  function choose(parent, words, options, change) {
    var label = made("label", parent, words + " "), select = made("select", label);
    options.forEach(function (o, i) { made("option", select, o).value = i; });
    select.addEventListener("change", change);
    return select;
  }
  /* uPlot's own labels have three decimals at most: 0, 0 and -0 along an axis of small values */
  function labels(_, splits, index, space, step) {
    var format = new Intl.NumberFormat(navigator.language, { maximumFractionDigits: Math.min(12, Math.max(3, 1 + Math.ceil(-Math.log10(step)))) });
    return splits.map(function (v) {
      return v === null ? null : step < 0.001 && v !== 0 && Math.abs(v) < 0.001 ? Number(v.toPrecision(4)).toExponential() : format.format(v + 0);
    });
  }
  function axis(label, size) {
    return {
      values: labels,
      label: label || undefined, labelSize: label ? 18 : 0, labelFont: "12px system-ui, sans-serif",
      font: "11px system-ui, sans-serif", size: size, gap: 3,
      stroke: function () { return colour("--soft"); },
      grid: { stroke: function () { return colour("--rule"); }, width: 1 },
      ticks: { show: false }
    };
  }
  function place(plot, box, height) {
    function fit() { /* what is printed is as wide as A4, its grid has two columns */
      var most = !root.classList.contains("printing") ? 1e4 : box.closest(".grid") ? 330 : 680;
      plot.setSize({ width: Math.max(200, Math.min(most, box.clientWidth)), height: height });
    }
    drawn.push({ plot: plot, fit: fit });
    /* in the next frame: a change of size within the observer is one it complains of */
    if (window.ResizeObserver) { new ResizeObserver(function () { requestAnimationFrame(fit); }).observe(box); }
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
      });
      g.restore();
      g.save();
      g.fillStyle = colour("--soft"); g.font = 11 * devicePixelRatio + "px system-ui, sans-serif";
      g.textAlign = "center"; g.textBaseline = "bottom";
      data.sections.forEach(function (s) { /* above the plot, where no curve crosses them */
        var from = Math.max(b.left, u.valToPos(s.begin, "x", true)), to = Math.min(b.left + b.width, u.valToPos(s.end, "x", true));
        if (s.words && to - from > 40 * devicePixelRatio) { g.fillText(s.words, 0.5 * (from + to), b.top - 2); }
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
      g.font = 11 * devicePixelRatio + "px system-ui, sans-serif"; g.textAlign = "right";
      var room = y - b.top > 14 * devicePixelRatio; /* else below the line: radii are above the plot */
      g.textBaseline = room ? "bottom" : "top";
      g.fillText(q.limit_words, b.left + b.width - 4, room ? y - 2 : y + 3);
      g.restore();
    };
  }
  function range(q) {
    return function (u, low, high) {
      if (low === null) { return [0, 1]; }
      low = Math.min(0, low); high = Math.max(0, high);
      if (high - low < q.least) { low = -q.least; high = q.least; } /* rounding errors */
      if (q.limit > 0 && high > 0.5 * q.limit) { high = Math.max(high, q.limit); }
      if (q.limit < 0 && low < 0.5 * q.limit) { low = Math.min(low, q.limit); }
      var more = 0.06 * (high - low || 1);
      return [low < 0 ? low - more : low, high > 0 ? high + more : high];
    };
  }
  /* What a plot shows of fine values between two positions: of groups of cells the smallest and the
     largest value in their order, or the values themselves where the screen has room. */
  var ROOM = 1600;
  function seen(x, low, high) {
    var from = 0, to = x.length, group, picks = [];
    while (from < x.length - 2 && x[from + 2] <= low) { from += 2; }
    while (to > from + 2 && x[to - 3] >= high) { to -= 2; }
    group = Math.max(1, Math.ceil((to - from) / ROOM)) * 2;
    for (var k = from; k < to; k += group) { picks.push([k, Math.min(k + group, to)]); }
    return picks;
  }
  function thinnedTo(values, picks) {
    var found = [];
    picks.forEach(function (p) {
      if (p[1] - p[0] <= 2) { for (var i = p[0]; i < p[1]; i++) { found.push(values[i]); } return; }
      var low = -1, high = -1;
      for (var k = p[0]; k < p[1]; k++) {
        if (values[k] === null) { continue; }
        if (low < 0 || values[k] < values[low]) { low = k; }
        if (high < 0 || values[k] > values[high]) { high = k; }
      }
      found.push(low < 0 ? null : values[Math.min(low, high)], low < 0 ? null : values[Math.max(low, high)]);
    });
    return found;
  }
  function positions(x, picks) {
    var found = [];
    picks.forEach(function (p) {
      if (p[1] - p[0] <= 2) { for (var i = p[0]; i < p[1]; i++) { found.push(x[i]); } return; }
      var width = x[p[1] - 1] - x[p[0]];
      found.push(x[p[0]] + 0.25 * width, x[p[0]] + 0.75 * width);
    });
    return found;
  }
  function curves(box, data, key) {
    var points = 2 * data.cells, width = (data.high - data.low) / data.cells, fine = [], k;
    for (k = 0; k < data.cells; k++) { fine.push(data.low + (k + 0.25) * width, data.low + (k + 0.75) * width); }
    var lines = data.quantities.map(function (q) { return decoded(q, points); }), plots = [], titles = [], kept = {}, grid;
    var picks = seen(fine, data.low, data.high), x = positions(fine, picks), unit = data.axis.charAt(0) === "D" ? "m" : "s", over = unit === "m" ? "s (m)" : "t (s)";
    made("h3", box, data.track);
    var controls = made("div", box, undefined, "controls");
    var wheelset = choose(controls, "Wheelset", data.wheelsets.map(function (n, i) { return i + 1 + ": " + n; }), fill);
    var side = choose(controls, "Wheel", ["left", "right"], fill);
    var reset = made("button", controls, "Whole length");
    reset.type = "button";
    exports(controls, function () { return grid; }, function () { return data.track; });
    made("span", controls, "Drag over a plot to zoom all of them, double-click for the whole length.", "notes");
    var readings = made("div", box, undefined, "readings scroll"), table = made("table", readings);
    var head = made("tr", made("thead", table)), body = made("tbody", table), at = made("th", head), cells = [];
    data.quantities.forEach(function (q) { made("th", head, q.words + (q.unit ? " (" + q.unit + ")" : "")); });
    data.runs.forEach(function (name, i) {
      var row = made("tr", body), chip = made("span", made("td", row), name, "chip");
      chip.style.setProperty("--c", "var(--k" + (i % 8) + ")");
      chip.classList.toggle("dashed", i > 7); /* the colours of the first again */
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
      return [x].concat(data.runs.map(function (_, r) {
        var n = line(q, r), name = i + " " + n;
        if (!kept[name]) { kept[name] = lines[i](n); }
        return thinnedTo(kept[name], picks);
      }));
    }
    /* all plots together: what lies between the ends of the zoomed one, in the detail of the screen */
    var zooming = false;
    function zoom(low, high) {
      if (zooming) { return; }
      zooming = true;
      picks = seen(fine, low, high);
      x = positions(fine, picks);
      plots.forEach(function (u, i) { u.batch(function () { u.setData(values(i), false); u.setScale("x", { min: low, max: high }); }); });
      zooming = false;
      detail();
    }
    function detail() {
      var step = x.length > 2 ? x[2] - x[0] : width;
      note.textContent = data.axis + ". Each pair of points is the smallest and the largest value within " + rough(step) + " " + unit + "; zoomed, down to " + rough(width) + " " + unit + ".";
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
    function name() { /* above the plots, also of those that are printed or saved */
      titles.forEach(function (title, i) {
        var q = data.quantities[i], s = q.sides === 2 ? " " + ["left", "right"][side.value] : "";
        title.firstChild.data = q.words + ", wheelset " + (Number(wheelset.value) + 1) + s + " ";
      });
    }
    function fill() { name(); kept = {}; zoom(plots[0].scales.x.min, plots[0].scales.x.max); plots.forEach(function (u) { u.redraw(true, true); }); }
    grid = made("div", box, undefined, "grid");
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
      var title = made("h4", panel, q.words + " ");
      titles.push(title);
      if (q.sign) { made("small", title, q.sign); }
      var target = made("div", panel);
      target.setAttribute("role", "img");
      target.setAttribute("aria-label", q.words + " over the " + (unit === "m" ? "distance" : "time") + ", " + data.track);
      var u = new uPlot({
        width: Math.max(200, target.clientWidth), height: 210, legend: { show: false }, padding: [16, null, null, null],
        cursor: { sync: { key: key }, drag: { x: true, y: false }, bind: { dblclick: function () { return function () { zoom(data.low, data.high); return null; }; } } },
        scales: { x: { time: false }, y: { range: range(q) } },
        axes: [axis(over, 22), axis(q.symbol + (q.unit ? " (" + q.unit + ")" : ""), 46)],
        series: [{}].concat(data.runs.map(function (name, r) {
          return { label: name, stroke: function () { return runColour(r); }, dash: r > 7 ? [6, 3] : undefined, width: 1.4, points: { show: false } };
        })),
        hooks: { drawClear: [shade(data)], draw: [limitLine(q)], setCursor: [told], setScale: [function (u, name) {
          if (name === "x" && plots.length === data.quantities.length && !zooming) { zoom(u.scales.x.min, u.scales.x.max); }
        }] }
      }, values(i), target);
      u.beneath = { sections: data.sections, limit: q.limit, words: q.limit_words };
      plots.push(u);
      place(u, target, 210);
    });
    var note = made("p", box, "", "notes");
    name();
    detail();
    reset.addEventListener("click", function () { zoom(data.low, data.high); });
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
  function exports(parent, box, name) {
    ["PNG", "SVG"].forEach(function (kind) {
      var button = made("button", parent, "Save " + kind);
      button.type = "button";
      button.addEventListener("click", function () { (kind === "PNG" ? savePng : saveSvg)(box(), name().replace(/[^A-Za-z0-9]+/g, "_")); });
    });
  }
  var NS = "http://www.w3.org/2000/svg";
  function drawnAs(name, parent, attributes, text) {
    var node = document.createElementNS(NS, name);
    Object.keys(attributes).forEach(function (a) { node.setAttribute(a, attributes[a]); });
    if (text !== undefined) { node.textContent = text; }
    parent.appendChild(node);
    return node;
  }
  /* a picture of the page with its own colours */
  function standalone(picture) {
    var copy = picture.cloneNode(true), copies = copy.querySelectorAll("*");
    picture.querySelectorAll("*").forEach(function (node, i) {
      var style = getComputedStyle(node);
      ["fill", "stroke", "stroke-width", "opacity", "font-size", "paint-order"].forEach(function (n) { copies[i].setAttribute(n, style.getPropertyValue(n)); });
    });
    return framed(copy);
  }
  function framed(picture) {
    var box = picture.viewBox.baseVal;
    picture.setAttribute("xmlns", NS);
    picture.setAttribute("width", box.width);
    picture.setAttribute("height", box.height);
    picture.setAttribute("font-family", "sans-serif");
    picture.insertBefore(drawnAs("rect", picture, { width: box.width, height: box.height, fill: colour("--paper") }), picture.firstChild);
    return picture;
  }
  /* plots of a canvas as lines */
  function asSvg(box) {
    var found = plotsIn(box), W = 760, H = 250, left = 64, right = 12, top = 26, bottom = 44;
    var picture = document.createElementNS(NS, "svg");
    var named = found[0].series.slice(1).filter(function (s) { return s.show && s.class !== "quiet"; });
    picture.setAttribute("viewBox", "0 0 " + W + " " + (H * found.length + 18 * named.length + 8));
    named.forEach(function (s, i) {
      var y = H * found.length + 18 * i + 8, stroke = typeof s.stroke === "function" ? s.stroke(found[0], i + 1) : s.stroke;
      drawnAs("line", picture, { x1: left, x2: left + 24, y1: y, y2: y, stroke: stroke, "stroke-width": 3 });
      drawnAs("text", picture, { x: left + 32, y: y + 4 }, s.label);
    });
    picture.setAttribute("font-size", 12);
    picture.setAttribute("fill", colour("--soft"));
    found.forEach(function (u, row) {
      var y0 = row * H, sx = u.scales.x, sy = u.scales.y;
      function X(v) { return left + (v - sx.min) / (sx.max - sx.min) * (W - left - right); }
      function Y(v) { return y0 + H - bottom - (v - sy.min) / (sy.max - sy.min) * (H - top - bottom); }
      var panel = u.root.closest(".panel");
      if (panel) {
        var title = panel.querySelector("h4"), sign = title.children.length ? title.lastChild.textContent : "";
        if (sign.length > 80) { sign = sign.slice(sign.lastIndexOf(", ") + 2); } /* it would not fit */
        drawnAs("text", picture, { x: left, y: y0 + 16 }, title.firstChild.data.trim() + (sign ? ": " + sign : ""));
      }
      var beneath = u.beneath || { sections: [], limit: null };
      beneath.sections.forEach(function (s) {
        var from = Math.max(left, X(s.begin)), to = Math.min(W - right, X(s.end));
        if (to > from) { drawnAs("rect", picture, { x: from, y: y0 + top, width: to - from, height: H - top - bottom, fill: colour(s.curve ? "--curve" : "--transition") }); }
      });
      drawnAs("rect", picture, { x: left, y: y0 + top, width: W - left - right, height: H - top - bottom, fill: "none", stroke: colour("--strong") });
      if (beneath.limit !== null && beneath.limit >= sy.min && beneath.limit <= sy.max) {
        drawnAs("line", picture, { x1: left, x2: W - right, y1: Y(beneath.limit), y2: Y(beneath.limit), stroke: colour("--bad"), "stroke-dasharray": "6 4" });
        drawnAs("text", picture, { x: W - right - 4, y: Y(beneath.limit) + (Y(beneath.limit) - y0 - top > 14 ? -3 : 13), "text-anchor": "end", fill: colour("--bad") }, beneath.words);
      }
      function ticks(axis, place) { (axis._splits || []).forEach(function (v, i) { var text = axis._values[i]; if (text !== null && text !== undefined && text !== "") { place(v, text); } }); }
      ticks(u.axes[0], function (v, text) { if (v >= sx.min && v <= sx.max) { drawnAs("text", picture, { x: X(v), y: y0 + H - bottom + 15, "text-anchor": "middle" }, text); } });
      ticks(u.axes[1], function (v, text) { if (v >= sy.min && v <= sy.max) { drawnAs("text", picture, { x: left - 6, y: Y(v) + 4, "text-anchor": "end" }, text); } });
      drawnAs("text", picture, { x: 0.5 * (left + W - right), y: y0 + H - 10, "text-anchor": "middle" }, u.axes[0].label || "");
      drawnAs("text", picture, { x: 14, y: y0 + 0.5 * (top + H - bottom), transform: "rotate(-90 14 " + (y0 + 0.5 * (top + H - bottom)) + ")", "text-anchor": "middle" }, u.axes[1].label || "");
      u.series.forEach(function (s, i) {
        if (!i || !s.show || s.class === "quiet") { return; }
        var part = [], stroke = typeof s.stroke === "function" ? s.stroke(u, i) : s.stroke;
        function end() {
          if (part.length > 1 && s.width) { drawnAs("polyline", picture, { points: part.join(" "), fill: "none", stroke: stroke, "stroke-width": 1.3 }); }
          if (!s.width || (typeof s.points.show === "function" ? s.points.show(u, i) : s.points.show)) { part.forEach(function (p) { drawnAs("circle", picture, { cx: p[0], cy: p[1], r: 3, fill: stroke }); }); }
          part = [];
        }
        u.data[i].forEach(function (v, k) {
          var at = u.data[0][k];
          if (v === null || v === undefined) { if (!s.spanGaps) { end(); } } else if (at >= sx.min && at <= sx.max) { part.push([X(at).toFixed(1), Y(v).toFixed(1)]); }
        });
        end();
      });
    });
    return framed(picture);
  }
  function plotsIn(box) { return drawn.filter(function (d) { return box.contains(d.plot.root); }).map(function (d) { return d.plot; }); }
  function svgOf(box) {
    var picture = box.querySelector("svg");
    return "data:image/svg+xml," + encodeURIComponent(new XMLSerializer().serializeToString(picture ? standalone(picture) : asSvg(box)));
  }
  function saveSvg(box, name) { kept(svgOf(box), name + ".svg"); }
  function savePng(box, name) {
    var image = new Image();
    image.onload = function () {
      var sheet = made("canvas"), g = sheet.getContext("2d");
      sheet.width = 2 * image.width; sheet.height = 2 * image.height;
      g.fillStyle = colour("--paper"); g.fillRect(0, 0, sheet.width, sheet.height);
      g.drawImage(image, 0, 0, sheet.width, sheet.height);
      kept(sheet.toDataURL("image/png"), name + ".png");
    };
    image.src = svgOf(box);
  }
  function plot(options, values, target) {
    options.width = Math.max(200, target.clientWidth);
    place(new uPlot(options, values, target), target, options.height);
  }
  var study = all.spread && railsimStudy(all.spread, {
    made: made, shown: shown, choose: choose, colour: colour, runColour: runColour, faint: faint, axis: axis, plot: plot, exports: exports
  });

  document.querySelectorAll("[data-plots]").forEach(function (box) {
    var name = box.dataset.plots;
    if (study && study[name]) { study[name](box); } else { curves(box, all.curves[Number(name)], "curves" + name); }
  });
})();

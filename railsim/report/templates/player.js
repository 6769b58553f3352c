(function () {
  "use strict";
  var data = JSON.parse(document.getElementById("data").textContent), ns = "http://www.w3.org/2000/svg";
  var group = document.getElementById("drawing"), slider = document.getElementById("position");
  var position = document.getElementById("state"), button = document.getElementById("play");
  var svg = document.getElementById("view"), at = 0, step = 1, timer = null, unit = 1;
  function made(name, attributes) {
    var node = document.createElementNS(ns, name);
    Object.keys(attributes).forEach(function (key) { node.setAttribute(key, attributes[key]); });
    group.appendChild(node);
    return node;
  }
  var lines = data.lines.map(function (line) { return made("polyline", {"class": line.kind}); });
  var marks = data.fixed.map(function (p) { return made("path", {}); });
  function look(box) {
    svg.setAttribute("viewBox", box.join(" "));
    unit = Math.max(box[2], box[3]) / 420;
    lines.forEach(function (node, i) {
      var line = data.lines[i];
      node.setAttribute("stroke-width", line.width * unit);
      if (line.dash) { node.setAttribute("stroke-dasharray", line.dash.map(function (d) { return d * unit; }).join(" ")); }
    });
    marks.forEach(function (node, i) {
      var p = data.fixed[i], u = 5 * unit;
      node.setAttribute("d", "M" + p[0] + "," + p[1] + " l" + (-u) + "," + (1.7 * u) + " l" + (2 * u) + ",0 z");
    });
  }
  function show(k) {
    at = k;
    slider.value = k;
    position.textContent = data.texts[k];
    lines.forEach(function (node, i) { node.setAttribute("points", data.lines[i].points[k]); });
  }
  function tick() {
    if (at + step < 0 || at + step >= data.texts.length) { step = -step; }
    show(at + step);
  }
  button.addEventListener("click", function () {
    if (timer) { clearInterval(timer); timer = null; button.textContent = "Play"; return; }
    timer = setInterval(tick, 40);
    button.textContent = "Pause";
  });
  slider.addEventListener("input", function () { show(Number(slider.value)); });
  document.getElementById("whole").addEventListener("click", function () { look(data.whole); });
  document.getElementById("near").addEventListener("click", function () { look(data.near); });
  look(data.whole);
  show(0);
}());

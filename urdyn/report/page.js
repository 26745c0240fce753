"use strict";
// Draws every plot from the JSON beside it; colours of ink and grid come from page.css.
// One after the other, so that the page can be read meanwhile; all at once where it is printed.
const plots = [...document.querySelectorAll(".plot")];
const waiting = [...plots];
const options = { responsive: true, displayModeBar: false };

// Plotly takes words for markup, links included. A line's end and a box without a title are ours;
// all else is a name as a file has it.
const plain = (_, value) =>
  typeof value === "string"
    ? value.replaceAll("&", "&amp;").replace(/<(?!br>|\/?extra>)/g, "&lt;")
    : value;

const draw = (plot) => {
  const { data, layout } = JSON.parse(plot.nextElementSibling.textContent, plain);
  Plotly.newPlot(plot, data, layout, options);
};

const next = () => {
  if (waiting.length) {
    draw(waiting.shift());
    setTimeout(next);
  } else document.documentElement.dataset.drawn = "all";
};

addEventListener("beforeprint", () => {
  waiting.splice(0).forEach(draw);
  plots.forEach((plot) => Plotly.Plots.resize(plot));
});
addEventListener("afterprint", () => plots.forEach((plot) => Plotly.Plots.resize(plot)));
next();

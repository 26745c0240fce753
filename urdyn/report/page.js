"use strict";
// Draws every plot from the JSON beside it; colours of ink and grid come from page.css.
const plots = [...document.querySelectorAll(".plot")];
const options = { responsive: true, displayModeBar: false };

for (const plot of plots) {
  const { data, layout } = JSON.parse(plot.nextElementSibling.textContent);
  Plotly.newPlot(plot, data, layout, options);
}

const fit = () => plots.forEach((plot) => Plotly.Plots.resize(plot));
addEventListener("beforeprint", fit);
addEventListener("afterprint", fit);

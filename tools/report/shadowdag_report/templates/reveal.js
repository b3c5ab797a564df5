{# What a link within the page leads to is made visible, and takes the focus: a line that a filter hides, a chart
   behind another one, pictures. #}
(() => {
  function reveal() {
    let name = location.hash.slice(1);
    try {
      name = decodeURIComponent(name);
    } catch { // a percent sign of the name itself
    }
    const target = document.getElementById(name);
    if (!target)
      return;
    const fold = target.closest('details'), plot = target.closest('.plot'), table = target.closest('table');
    if (fold)
      fold.open = true;
    if (plot && plot.hidden)
      plots.show(plot);
    if (target.hidden)
      table?.clearFilter?.();
    if (target.matches('.pictures'))
      viewer.open(target);
    else if (target.matches('tr, .point')) {
      target.focus({preventScroll: true});
      target.scrollIntoView({block: 'center'});
    }
  }
  window.addEventListener('hashchange', reveal);
  document.addEventListener('click', event => { // the same link again
    const link = event.target.closest('a[href^="#"]');
    if (link && !event.defaultPrevented && link.getAttribute('href') === location.hash)
      reveal();
  });
  addEventListener('load', () => setTimeout(reveal)); // after the browser has gone to the place itself
})();

{# The interactive charts: pointer and focus show a point's line of the table beside it, with its picture and its
   failing pixels; a press or Enter goes to that line, arrow keys to the next point. All numbers are those of the
   table. #}
const plots = (() => {
  const all = [...document.querySelectorAll('.plot')];
  const make = (name, text) => {
    const e = document.createElement(name);
    if (text !== undefined)
      e.textContent = text;
    return e;
  };
  const rowOf = point => document.getElementById(point.getAttribute('href').slice(1));

  function showDetail(plot, point) {
    const detail = plot.querySelector('.detail'), row = rowOf(point);
    plot.querySelectorAll('.is-current').forEach(p => p.classList.remove('is-current'));
    document.querySelectorAll('tr.hot').forEach(r => r.classList.remove('hot'));
    point.classList.add('is-current');
    detail.replaceChildren();
    if (!row)
      return;
    row.classList.add('hot');
    const facts = make('dl');
    tables.headings(row.closest('table')).forEach((th, i) => {
      const cell = row.cells[i];
      if ('fact' in th.dataset && cell.textContent)
        facts.append(make('dt', th.textContent),
                     make('dd', cell.textContent + (cell.title ? ' (' + cell.title + ')' : '')));
    });
    detail.append(make('h3', row.cells[0].textContent), facts);
    const group = document.querySelector('.pictures[data-row="' + row.id + '"]');
    const links = make('p');
    links.className = 'links';
    const toRow = make('a', 'Line in the table');
    toRow.href = '#' + row.id;
    links.append(toRow);
    if (group) {
      const shots = make('div');
      shots.className = 'shots';
      for (const kind of ['color', 'error']) {
        const source = group.querySelector('[data-kind=' + kind + ']');
        if (!source)
          continue;
        const figure = make('figure'), img = make('img');
        img.src = source.querySelector('img').src;
        img.alt = source.querySelector('img').alt;
        figure.append(img, make('figcaption', kind === 'error' ? 'Failing pixels' : 'The method'));
        shots.append(figure);
      }
      detail.append(shots);
      const toPictures = make('a', 'Pictures side by side');
      toPictures.href = '#' + group.id;
      links.append(toPictures);
    }
    detail.append(links);
  }

  all.forEach((plot, number) => {
    const points = [...plot.querySelectorAll('.point')];
    let touched = null;
    const current = point => points.forEach(p => p.setAttribute('tabindex', p === point ? '0' : '-1'));
    points.forEach(point => {
      point.querySelector('title').remove(); // the name is in aria-label, and the details are beside the chart
      point.addEventListener('pointerenter', () => showDetail(plot, point));
      point.addEventListener('focus', () => {
        current(point);
        showDetail(plot, point);
      });
      point.addEventListener('click', event => { // the first touch of a point only shows it
        if (event.pointerType === 'touch' && touched !== point) {
          event.preventDefault();
          touched = point;
          showDetail(plot, point);
        }
      });
      point.addEventListener('keydown', event => {
        const seen = points.filter(p => p.getClientRects().length > 0);
        const step = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1}[event.key];
        const next = event.key === 'Home'  ? seen[0]
                     : event.key === 'End' ? seen.at(-1)
                                           : step && seen[seen.indexOf(point) + step];
        if (step || event.key === 'Home' || event.key === 'End')
          event.preventDefault();
        if (next)
          next.focus();
      });
      const row = rowOf(point);
      row?.addEventListener('pointerenter', () => showDetail(plot, point));
    });
    plot.querySelectorAll('.legend button').forEach((button, series) => button.addEventListener('click', () => {
      const isOn = button.getAttribute('aria-pressed') === 'false';
      button.setAttribute('aria-pressed', String(isOn));
      plot.querySelectorAll('[data-series="' + series + '"]').forEach(part => part.classList.toggle('is-off', !isOn));
    }));
    const first = points.find(p => p.querySelector('.ring')) ?? points[0];
    if (first) {
      current(first);
      showDetail(plot, first);
      document.querySelectorAll('tr.hot').forEach(r => r.classList.remove('hot'));
    }
    plot.hidden = number > 0;
  });
  document.addEventListener(
      'filtered', () => all.forEach(plot => plot.querySelectorAll('.point').forEach(
                                        point => point.classList.toggle('is-faded', Boolean(rowOf(point)?.hidden)))));

  function show(plot) {
    all.forEach(other => { other.hidden = other !== plot; });
    const select = document.querySelector('.plot-select');
    if (select)
      select.value = plot.id;
  }
  if (all.length > 1) {
    const label = make('label', 'Frame '), select = make('select');
    select.className = 'plot-select';
    all.forEach(plot => select.append(new Option(plot.dataset.name, plot.id)));
    select.addEventListener('change', () => show(document.getElementById(select.value)));
    label.append(select);
    all[0].before(label);
  }
  return {show};
})();

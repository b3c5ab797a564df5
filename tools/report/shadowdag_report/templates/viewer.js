{# Pictures side by side: two of them under a divider, all of a row beside it, with the same zoom and pan in all;
   where the page holds the lights of the frame, their table, linked to their places in the picture. In the page's
   .viewer-here, else in a dialog that a press on a picture opens. #}
const viewer = (() => {
  const groups = [...document.querySelectorAll('.pictures')];
  if (groups.length === 0)
    return {open() {}};
  const make = (name, properties, ...children) => {
    const e = Object.assign(document.createElement(name), properties);
    e.append(...children);
    return e;
  };
  const button = (text, label, action) => {
    const e = make('button', {type: 'button', textContent: text, title: label});
    e.setAttribute('aria-label', label);
    e.addEventListener('click', action);
    return e;
  };
  const pictures = groups.map(group => [...group.querySelectorAll('figure')].map(figure => {
    const img = figure.querySelector('img');
    return {src: img.src, alt: img.alt, caption: figure.querySelector('figcaption').textContent};
  }));
  const data = JSON.parse(document.getElementById('report-data')?.textContent ?? 'null');
  const state = {group: 0, left: '0/0', right: '0/1', zoom: 1, x: 0, y: 0, split: 50};

  const which = make('select'), left = make('select'), right = make('select'),
        zoomed = make('output', {className: 'zoomed'});
  const under = make('img'), over = make('img'), rings = make('div', {className: 'lights'}),
        strip = make('div', {className: 'strip'});
  const leftTag = make('span', {className: 'tag'}), rightTag = make('span', {className: 'tag'}),
        divider = make('div', {className: 'divider'});
  const stage = make('div', {className: 'stage', tabIndex: 0}, make('div', {className: 'pane'}, under),
                     make('div', {className: 'pane over'}, over), rings, divider, leftTag, rightTag);
  stage.setAttribute('role', 'group');
  const slider = make('input', {type: 'range', min: 0, max: 100, step: 1, value: 50});
  slider.setAttribute('aria-label', 'Divider between the left and the right picture, percent from the left');
  const showLights = make('input', {type: 'checkbox'});
  const lightsLabel = make('label', {hidden: true}, showLights, ' Lights');
  const lightTable = make('div', {className: 'light-table'});
  const root = make(
      'div', {className: 'viewer'},
      make('div', {className: 'bar'}, make('label', {}, 'Pictures of ', which), make('label', {}, 'Left ', left),
           make('label', {}, 'Right ', right), button('\u21C4', 'Exchange left and right', exchange),
           make('span', {}, button('\u2212', 'Zoom out', () => zoomAt(1 / 1.5)), ' ', zoomed, ' ',
                button('+', 'Zoom in', () => zoomAt(1.5)), ' ', button('Fit', 'Whole picture', fit)),
           lightsLabel),
      make('div', {className: 'panes'}, make('div', {}, stage, slider), strip), make('p', {
        className: 'hint',
        innerHTML:
            'Drag the divider, or the picture when it is zoomed. On the focused picture: wheel or <kbd>+</kbd> ' +
            '<kbd>\u2212</kbd> <kbd>0</kbd> zoom, arrows pan, <kbd>,</kbd> <kbd>.</kbd> move the divider, ' +
            '<kbd>x</kbd> exchanges left and right, <kbd>n</kbd> <kbd>p</kbd> next and previous pictures.'
      }),
      lightTable);
  const here = document.querySelector('.viewer-here');
  let dialog = null;
  if (here)
    here.append(root);
  else {
    dialog = make('dialog', {}, button('\u2715', 'Close', () => dialog.close()), root);
    dialog.setAttribute('aria-label', 'Pictures side by side');
    document.body.append(dialog);
  }

  const pictureOf = value => {
    const [g, i] = value.split('/').map(Number);
    return pictures[g]?.[i];
  };

  function place() {
    const limit = v => Math.min(0, Math.max(-100 * (state.zoom - 1), v));
    state.x = limit(state.x);
    state.y = limit(state.y);
    for (const [name, value] of [['--z', state.zoom], ['--x', state.x], ['--y', state.y], ['--split', state.split]])
      root.style.setProperty(name, value);
    root.classList.toggle('is-zoomed', state.zoom > 1);
    root.classList.toggle('is-near', state.zoom >= 2);
    zoomed.textContent = state.zoom.toFixed(1) + '\u00D7';
    slider.value = state.split;
  }

  // Keeps the point of the picture that is at (px, py) percent of the pane.
  function zoomAt(factor, px = 50, py = 50) {
    const zoom = Math.min(32, Math.max(1, state.zoom * factor)), ratio = zoom / state.zoom;
    state.x = px - (px - state.x) * ratio;
    state.y = py - (py - state.y) * ratio;
    state.zoom = zoom;
    place();
  }
  function fit() {
    state.zoom = 1;
    place();
  }
  function exchange() {
    [state.left, state.right] = [state.right, state.left];
    show();
  }

  function show() {
    const group = state.group, list = pictures[group], frame = groups[group].dataset.frame;
    which.value = group;
    for (const [select, key] of [[left, 'left'], [right, 'right']]) {
      const of = (g, i, text) => {
        const option = new Option(text, g + '/' + i);
        option.selected = option.value === state[key];
        return option;
      };
      const own = make('optgroup', {label: groups[group].dataset.name}, ...list.map((p, i) => of(group, i, p.caption)));
      const others = groups.flatMap(
          (g, i) => i !== group && frame !== undefined && g.dataset.frame === frame ? [of(i, 0, g.dataset.name)] : []);
      select.replaceChildren(own, ...(others.length ? [make('optgroup', {label: 'Other runs'}, ...others)] : []));
    }
    const named = value => (Number(value.split('/')[0]) === group ? pictureOf(value).caption
                                                                  : groups[Number(value.split('/')[0])].dataset.name);
    for (const [img, tag, key] of [[under, leftTag, 'left'], [over, rightTag, 'right']]) {
      img.src = pictureOf(state[key]).src;
      img.alt = pictureOf(state[key]).alt;
      tag.textContent = named(state[key]);
    }
    stage.setAttribute('aria-label', 'Left: ' + under.alt + '. Right: ' + over.alt);
    strip.classList.toggle('is-two', list.length > 2);
    strip.replaceChildren(...list.map((p, i) => {
      const e = make('button', {type: 'button', title: 'Show it on the right'},
                     make('div', {className: 'pane'}, make('img', {src: p.src, alt: p.alt})),
                     make('span', {textContent: p.caption}));
      e.setAttribute('aria-pressed', String(state.right === group + '/' + i));
      e.addEventListener('click', () => {
        state.right = group + '/' + i;
        show();
        strip.children[i].focus();
      });
      return e;
    }));
    place();
  }

  function select(group, shown) {
    const moved = value => {
      const [g, i] = value.split('/').map(Number);
      return g === state.group && i < pictures[group].length ? group + '/' + i : value;
    };
    const isInFrame = value => groups[Number(value.split('/')[0])].dataset.frame === groups[group].dataset.frame &&
                               groups[group].dataset.frame !== undefined;
    for (const key of ['left', 'right']) {
      state[key] = moved(state[key]);
      if (!pictureOf(state[key]) || Number(state[key].split('/')[0]) !== group && !isInFrame(state[key]))
        state[key] = group + '/' + Math.min(key === 'left' ? 0 : 1, pictures[group].length - 1);
    }
    state.group = group;
    if (shown > 0) {
      state.left = group + '/0';
      state.right = group + '/' + shown;
    }
    show();
    showTableOfLights();
  }

  const percentOf = (part, whole) => (whole > 0 ? (100 * part / whole).toFixed(3) : '');
  function showTableOfLights() {
    const group = groups[state.group], rows = data?.lights?.rows[group.dataset.row],
          at = data?.lights?.places[group.dataset.frame];
    rings.replaceChildren();
    lightTable.replaceChildren();
    lightsLabel.hidden = !at;
    if (!rows)
      return;
    const keys = data.lights.columns, number = value => typeof value === 'number' && !Number.isInteger(value)
                                                            ? value.toPrecision(4)
                                                            : String(value ?? '');
    const names = [...data.lights.headings, 'Wrong, %'];
    const light = keys.indexOf('light'), pairs = keys.indexOf('pair_count'), dark = keys.indexOf('false_shadow_count'),
          lit = keys.indexOf('false_light_count');
    const body = make('tbody'), ringOf = {}, rowOf = {};
    const mark = (id, isHot) => {
      ringOf[id]?.classList.toggle('hot', isHot);
      rowOf[id].classList.toggle('hot', isHot);
    };
    for (const values of rows) {
      const row = make('tr', {tabIndex: -1}, ...values.map(value => {
        const cell = make('td', {textContent: number(value)});
        if (typeof value === 'number')
          cell.dataset.v = value;
        return cell;
      }));
      const wrong = percentOf(values[dark] + values[lit], values[pairs]), cell = make('td', {textContent: wrong});
      if (wrong)
        cell.dataset.v = wrong;
      row.append(cell);
      const id = values[light];
      rowOf[id] = row;
      if (at?.lights[id]) {
        const [x, y] = at.lights[id], ring = make('button', {type: 'button', className: 'light', title: 'Light ' + id});
        ring.setAttribute('aria-label', 'Light ' + id + ': its line in the table');
        ring.style.setProperty('--px', 100 * x / at.width);
        ring.style.setProperty('--py', 100 * y / at.height);
        ring.addEventListener('click', () => {
          row.focus();
          row.scrollIntoView({block: 'center'});
        });
        ring.addEventListener('pointerenter', () => mark(id, true));
        ring.addEventListener('pointerleave', () => mark(id, false));
        ringOf[id] = ring;
        rings.append(ring);
      }
      for (const [event, isHot] of [['pointerenter', true], ['focus', true], ['pointerleave', false], ['blur', false]])
        row.addEventListener(event, () => mark(id, isHot));
      row.addEventListener('keydown', event => { // from light to light
        const next = {ArrowDown: row.nextElementSibling, ArrowUp: row.previousElementSibling}[event.key];
        if (next) {
          event.preventDefault();
          next.focus();
        }
      });
      body.append(row);
    }
    if (body.rows.length)
      body.rows[0].tabIndex = 0;
    const table = make(
        'table', {className: 'sortable'},
        make('thead', {}, make('tr', {}, ...names.map(name => make('th', {scope: 'col', textContent: name})))), body);
    const fold = make(
        'details', {open: rows.length < 100},
        make('summary', {textContent: rows.length + ' lights by ' + group.dataset.name}), make('p', {
          className: 'hint',
          textContent:
              at ? 'A line shows its light in the picture; a ring in the picture leads to its line. ' +
                    'Lights beyond its edges have no ring.'
                 : 'These results hold no places of lights in the picture.'
        }),
        make('div', {className: 'scroll'}, table));
    lightTable.append(fold);
    tables.prepare(table);
  }

  function open(group, shown = 0) {
    select(groups.indexOf(group), shown);
    if (dialog && !dialog.open)
      dialog.showModal();
    if (!dialog)
      root.scrollIntoView({block: 'start'});
    stage.focus({preventScroll: true});
  }

  groups.forEach((group, g) => {
    which.append(new Option(group.dataset.name, g));
    group.querySelectorAll('figure').forEach(
        (figure, i) => figure.querySelector('a').addEventListener('click', event => {
          if (event.ctrlKey || event.metaKey || event.shiftKey) // a tab of its own
            return;
          event.preventDefault();
          open(group, i);
        }));
  });
  which.addEventListener('change', () => select(Number(which.value), 0));
  left.addEventListener('change', () => {
    state.left = left.value;
    show();
  });
  right.addEventListener('change', () => {
    state.right = right.value;
    show();
  });
  slider.addEventListener('input', () => {
    state.split = Number(slider.value);
    place();
  });
  showLights.addEventListener('change', () => root.classList.toggle('has-lights', showLights.checked));

  const percentAt = event => {
    const box = stage.getBoundingClientRect();
    return [100 * (event.clientX - box.left) / box.width, 100 * (event.clientY - box.top) / box.height];
  };
  let drag = null;
  stage.addEventListener('pointerdown', event => {
    if (event.button !== 0 || event.target.closest('.light'))
      return;
    const [x, y] = percentAt(event);
    drag = {isDivider: event.target === divider || state.zoom === 1, x: x - state.x, y: y - state.y};
    stage.setPointerCapture(event.pointerId);
    if (drag.isDivider) {
      state.split = Math.min(100, Math.max(0, x));
      place();
    }
  });
  stage.addEventListener('pointermove', event => {
    if (!drag)
      return;
    const [x, y] = percentAt(event);
    if (drag.isDivider)
      state.split = Math.min(100, Math.max(0, x));
    else
      [state.x, state.y] = [x - drag.x, y - drag.y];
    place();
  });
  for (const end of ['pointerup', 'pointercancel'])
    stage.addEventListener(end, () => { drag = null; });
  stage.addEventListener('dragstart', event => event.preventDefault());
  stage.addEventListener('wheel', event => { // the page scrolls on, unless the picture has the focus
    if (document.activeElement !== stage && !event.ctrlKey)
      return;
    event.preventDefault();
    zoomAt(Math.exp(-0.002 * event.deltaY), ...percentAt(event));
  }, {passive: false});
  stage.addEventListener('dblclick', event => zoomAt(2, ...percentAt(event)));
  stage.addEventListener('keydown', event => {
    const pan = (x, y) => {
      state.x += x;
      state.y += y;
      place();
    };
    const split = by => {
      state.split = Math.min(100, Math.max(0, state.split + by));
      place();
    };
    const turn = by => select((state.group + by + groups.length) % groups.length, 0);
    const action = {
      '+': () => zoomAt(1.5),
      '=': () => zoomAt(1.5),
      '-': () => zoomAt(1 / 1.5),
      '0': fit,
      ArrowLeft: () => pan(10, 0),
      ArrowRight: () => pan(-10, 0),
      ArrowUp: () => pan(0, 10),
      ArrowDown: () => pan(0, -10),
      ',': () => split(-5),
      '.': () => split(5),
      x: exchange,
      n: () => turn(1),
      p: () => turn(-1)
    }[event.key];
    const isOfPage = event.key.startsWith('Arrow') && state.zoom === 1; // nothing to pan: the page scrolls
    if (!action || isOfPage || event.ctrlKey || event.altKey || event.metaKey)
      return;
    event.preventDefault();
    action();
  });
  select(0, 0);
  return {open};
})();

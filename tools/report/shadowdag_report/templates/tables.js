{# Tables: a press on a heading sorts, again the other way; words above a table leave the lines that hold all of
   them. #}
const tables = (() => {
  const plain = text => text.toLowerCase().replace(/[^a-z0-9]/g, '');
  const valueOf = cell => cell ? cell.dataset.v ?? cell.textContent : '';
  const headings = table => [...table.tHead.rows[0].cells];

  function sortBy(table, th) {
    const body = table.tBodies[0], isUp = th.getAttribute('aria-sort') !== 'ascending', column = th.cellIndex;
    headings(table).forEach(other => other.removeAttribute('aria-sort'));
    th.setAttribute('aria-sort', isUp ? 'ascending' : 'descending');
    [...body.rows]
        .sort((a, b) => {
          const x = valueOf(a.cells[column]), y = valueOf(b.cells[column]), d = x - y;
          return (isNaN(d) || x === '' || y === '' ? x.localeCompare(y) : d) * (isUp ? 1 : -1);
        })
        .forEach(row => body.append(row));
  }

  // "word" must be in the line, "-word" must not, "time<200" compares the first column whose heading begins so.
  function condition(table, word) {
    const match = /^(.+?)(<=|>=|<|>|=)(-?[\d.]+)$/.exec(word);
    const column = match ? headings(table).findIndex(th => plain(th.textContent).startsWith(plain(match[1]))) : -1;
    if (column >= 0) {
      const limit = Number(match[3]);
      return row => {
        const value = parseFloat(valueOf(row.cells[column]));
        return {
          '<': value < limit,
          '>': value > limit,
          '<=': value <= limit,
          '>=': value >= limit,
          '=': value === limit
        }[match[2]];
      };
    }
    const isNot = word.length > 1 && word[0] === '-', text = (isNot ? word.slice(1) : word).toLowerCase();
    return row => row.textContent.toLowerCase().includes(text) !== isNot;
  }

  function filter(table, text) {
    const conditions = text.trim().split(/\s+/).filter(Boolean).map(word => condition(table, word));
    let count = 0;
    for (const row of table.tBodies[0].rows) {
      row.hidden = !conditions.every(holds => holds(row));
      count += row.hidden ? 0 : 1;
    }
    table.dispatchEvent(new CustomEvent('filtered', {bubbles: true}));
    return count;
  }

  function prepare(table) {
    headings(table).forEach(th => {
      const button = document.createElement('button');
      button.type = 'button';
      button.append(...th.childNodes);
      button.addEventListener('click', () => sortBy(table, th));
      th.append(button);
    });
    const total = table.tBodies[0].rows.length;
    if (total < 7)
      return;
    const bar = document.createElement('div'), input = document.createElement('input'),
          said = document.createElement('output');
    bar.className = 'filter';
    input.type = 'search';
    const numbers = headings(table).filter((th, i) => table.tBodies[0].rows[0].cells[i]?.dataset.v);
    const number = numbers.find(th => /time|error|wrong/i.test(th.textContent)) ?? numbers[0];
    input.placeholder =
        'Filter: word, -word' +
        (number ? ', ' + number.textContent.split(/[,:(]/)[0].trim().toLowerCase().replace(/\s+/g, '-') + '<100' : '');
    input.setAttribute('aria-label', 'Filter the lines of the table');
    const show = () => { said.textContent = filter(table, input.value) + ' of ' + total + ' lines'; };
    input.addEventListener('input', show);
    bar.append(input, said);
    table.parentElement.before(bar);
    said.textContent = total + ' lines';
    table.clearFilter = () => {
      input.value = '';
      show();
    };
  }

  document.querySelectorAll('table.sortable').forEach(prepare);
  return {prepare, headings};
})();

document.querySelectorAll('table.sortable th').forEach((th, column) => th.addEventListener('click', () => {
  const body = th.closest('table').tBodies[0], rows = [...body.rows];
  const value = row => { const c = row.cells[th.cellIndex]; return c.dataset.v ?? c.textContent; };
  const up = th.dataset.up !== '1'; th.dataset.up = up ? '1' : '0';
  rows.sort((a, b) => { const x = value(a), y = value(b), d = x - y;
    return (isNaN(d) ? x.localeCompare(y) : d) * (up ? 1 : -1); });
  rows.forEach(row => body.append(row));
}));

{# The switch between the system's colours, light and dark; it is kept for all reports of this browser. In the head,
   so that no page flashes. #}
(() => {
  const key = 'shadowdag-theme', root = document.documentElement, names = {'': 'System', light: 'Light', dark: 'Dark'};
  let theme = '';
  try {
    theme = localStorage.getItem(key) || '';
  } catch (denied) {
    theme = '';
  }
  const apply = () => {
    if (theme in names && theme)
      root.dataset.theme = theme;
    else
      delete root.dataset.theme;
  };
  apply();
  document.addEventListener('DOMContentLoaded', () => {
    const button = document.createElement('button');
    button.className = 'theme';
    button.type = 'button';
    const show = () => {
      button.textContent = '\u25D0 ' + names[theme];
      button.setAttribute('aria-label', 'Colours: ' + names[theme] + '. Press for the next.');
    };
    button.addEventListener('click', () => {
      theme = {'': 'dark', dark: 'light', light: ''}[theme];
      try {
        localStorage.setItem(key, theme);
      } catch (denied) { /* the choice lasts as long as the page */
      }
      apply();
      show();
    });
    show();
    document.body.prepend(button);
  });
})();

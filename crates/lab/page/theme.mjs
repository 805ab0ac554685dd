// Light or dark: as the system has it, or as the button was last pressed.
const root = document.documentElement;

try { if (localStorage.getItem('theme')) root.dataset.theme = localStorage.getItem('theme'); } catch { /* As the system has it. */ }

/** The button that changes it; `changed` is called when it has. */
export function theme(button, changed) {
  const system = matchMedia('(prefers-color-scheme: dark)');
  button.addEventListener('click', () => {
    const now = root.dataset.theme ?? (system.matches ? 'dark' : 'light');
    root.dataset.theme = now === 'dark' ? 'light' : 'dark';
    try { localStorage.setItem('theme', root.dataset.theme); } catch { /* Not kept. */ }
    changed();
  });
  system.addEventListener('change', changed);
}

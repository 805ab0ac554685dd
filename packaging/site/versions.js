// The switch between versions of the manual: scripts/site.sh puts each into a folder of its own, beside versions.json with their names.
// A manual that stands alone has no such file beside it, and no switch.
(async () => {
  const root = new URL(path_to_root || '.', location.href);
  const above = new URL('../', root);
  const answer = await fetch(new URL('versions.json', above)).catch(() => null);
  const bar = document.querySelector('.right-buttons');
  if (!answer?.ok || !bar) return;
  const { latest, versions } = await answer.json();
  const here = decodeURIComponent(root.pathname.slice(above.pathname.length).replace(/\/$/, ''));
  const select = document.createElement('select');
  select.id = 'versions';
  select.title = 'Version of the manual';
  select.setAttribute('aria-label', select.title);
  select.style.cssText = 'margin:.7rem 0;font-size:1.4rem;max-width:10em';
  for (const name of ['latest', ...versions]) {
    const text = name === 'latest' ? `latest (${latest})` : name;
    select.add(new Option(text, name, name === here, name === here));
  }
  select.addEventListener('change', async () => {
    const other = new URL(`${encodeURIComponent(select.value)}/`, above);
    const page = new URL(location.pathname.slice(root.pathname.length), other);
    const there = await fetch(page, { method: 'HEAD' }).catch(() => null);
    // A version that does not have this page shows its first one.
    location.href = there?.ok ? page.href + location.hash : other.href;
  });
  bar.prepend(select);
})();

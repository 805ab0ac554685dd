'use strict';
(() => {
  const root = document.documentElement;
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const darkScheme = matchMedia('(prefers-color-scheme: dark)');
  const isDark = () => (root.dataset.theme ? root.dataset.theme === 'dark' : darkScheme.matches);
  const charts = [];

  // Theme: the system's, until the button was used; remembered where storage exists.
  const button = document.getElementById('theme');
  const themed = () => {
    button.textContent = isDark() ? 'Light' : 'Dark';
    button.setAttribute('aria-label', `Switch to ${isDark() ? 'light' : 'dark'} colours`);
    charts.forEach(chart => chart.draw());
  };
  button.hidden = false;
  button.addEventListener('click', () => {
    root.dataset.theme = isDark() ? 'light' : 'dark';
    try { localStorage.setItem('standstill-theme', root.dataset.theme); } catch { /* not remembered */ }
    themed();
  });
  darkScheme.addEventListener('change', themed);

  // Code: copying works without the clipboard's interface, too, which some browsers refuse to files.
  for (const copy of all('button.copy')) {
    copy.hidden = false;
    copy.addEventListener('click', async () => {
      const code = copy.closest('figure').querySelector('code');
      let done = true;
      try {
        await navigator.clipboard.writeText(code.textContent);
      } catch {
        getSelection().selectAllChildren(code);
        done = document.execCommand('copy');
      }
      copy.textContent = done ? 'Copied' : 'Selected';
      setTimeout(() => { copy.textContent = 'Copy'; }, 1600);
    });
  }

  // Tables
  // Of a value with its interval or share in brackets, the value.
  const value = text => {
    const digits = text.split(/[[(]/)[0].replace('−', '-').replace(/[\s\u2009]/g, '');
    return digits === '' ? NaN : Number(digits);
  };
  for (const box of all('div.table')) {
    const body = box.querySelector('tbody');
    const rows = [...body.rows];
    const heads = all('thead th', box);
    // Rows that have their names in front are of different quantities and units: no column of them has an order.
    const isList = heads[0]?.textContent.trim() === '';
    heads.forEach((head, column) => {
      if (isList) return;
      const sort = document.createElement('button');
      sort.type = 'button';
      sort.append(...head.childNodes);
      head.append(sort);
      head.setAttribute('aria-sort', 'none');
      const numeric = head.classList.contains('number');
      sort.addEventListener('click', () => {
        const up = head.getAttribute('aria-sort') !== 'ascending';
        heads.forEach(other => other.setAttribute('aria-sort', 'none'));
        head.setAttribute('aria-sort', up ? 'ascending' : 'descending');
        const keyed = rows.map((row, place) => {
          const text = row.cells[column].textContent;
          const key = numeric ? value(text) : text;
          // What has no value comes last either way.
          return { row, place, key, none: numeric ? Number.isNaN(key) : text === '' };
        });
        const order = numeric ? (a, b) => (a < b ? -1 : a > b ? 1 : 0)
          : new Intl.Collator('en', { numeric: true }).compare;
        keyed.sort((a, b) => a.none - b.none
          || (a.none ? 0 : (up ? 1 : -1) * order(a.key, b.key)) || a.place - b.place);
        body.append(...keyed.map(entry => entry.row));
      });
    });
    const filter = box.querySelector('.filter');
    if (!filter) continue;
    filter.hidden = false;
    const texts = rows.map(row => [...row.cells].map(cell => cell.textContent).join('\t').toLowerCase());
    const count = filter.querySelector('.count');
    const input = filter.querySelector('input');
    input.addEventListener('input', () => {
      const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      rows.forEach((row, i) => {
        row.hidden = !words.every(word => texts[i].includes(word));
        shown += !row.hidden;
      });
      count.textContent = words.length ? `${shown} of ${rows.length} rows` : `${rows.length} rows`;
    });
  }

  // The section in view, in the table of contents.
  const links = new Map(all('.contents a').map(link => [link.hash.slice(1), link]));
  if (links.size) {
    const heads = all('h2[id]');
    const mark = () => {
      const end = innerHeight + scrollY >= root.scrollHeight - 2;
      const above = heads.filter(head => head.getBoundingClientRect().top < innerHeight / 3);
      const current = end ? heads.at(-1) : above.at(-1) || heads[0];
      links.forEach((link, id) => (id === current.id ? link.setAttribute('aria-current', 'true')
        : link.removeAttribute('aria-current')));
    };
    addEventListener('scroll', mark, { passive: true });
    mark();
  }

  // Charts
  const palette = JSON.parse(document.getElementById('palette')?.textContent || '{}');
  const opaque = /^rgba?\((\d+,\d+,\d+)(,[\d.]+)?\)$/;
  const translate = (item, key) => {
    if (Array.isArray(item)) {
      // Data can be long, and have no colours.
      const walk = /color$|^shapes$|^annotations$/.test(key);
      return walk ? item.map(part => translate(part, key)) : item;
    }
    if (item && typeof item === 'object') {
      return Object.fromEntries(Object.entries(item).map(([name, part]) => [name, translate(part, name)]));
    }
    if (typeof item !== 'string' || !/color$/.test(key) || !isDark()) return item;
    const match = opaque.exec(item);
    const found = match && palette[match[1]];
    return found ? `rgb${match[2] ? 'a' : ''}(${found}${match[2] || ''})` : item;
  };
  const family = getComputedStyle(document.body).fontFamily;
  // A drag on a touch screen scrolls the page; the buttons of the chart zoom.
  const touch = matchMedia('(pointer: coarse)').matches;

  // Marks of a logarithmic axis with the numbers of the drawn figure: of these sets the densest that fits, by mantissas
  // and by every how many decades. Null in a part of a decade so small that differences make better marks.
  const sets = [[[1, 1.5, 2, 3, 4, 5, 7], 1], [[1, 2, 5], 1], [[1, 3], 1],
    ...[1, 2, 3, 5, 10, 20, 50, 100].map(every => [[1], every])];
  const decades = (range, pixels, across) => {
    const [low, high] = range[0] < range[1] ? range : [range[1], range[0]];
    const places = ([mantissas, every]) => {
      const found = [];
      for (let exponent = Math.floor(low); exponent <= high; exponent += 1) {
        if (exponent % every) continue;
        for (const mantissa of mantissas) {
          const at = exponent + Math.log10(mantissa);
          if (at > low - 1e-9 && at < high + 1e-9) found.push({ at, mantissa, exponent });
        }
      }
      return found;
    };
    const label = marks => {
      const plain = marks.every(({ exponent }) => exponent >= -4 && exponent < 6);
      return marks.map(({ mantissa, exponent }) => {
        if (plain) return (mantissa * 10 ** exponent).toFixed(Math.max(0, (mantissa % 1 ? 1 : 0) - exponent));
        const power = `10<sup>${String(exponent).replace('-', '−')}</sup>`;
        return exponent === 0 ? String(mantissa) : mantissa === 1 ? power : `${mantissa}·${power}`;
      });
    };
    const width = text => 6.8 * text.replace(/<.*?>/g, '').length;
    const fits = ({ marks, texts }) => marks.every((mark, i) => i === 0
      || ((mark.at - marks[i - 1].at) * pixels) / (high - low)
        >= (across ? (width(texts[i]) + width(texts[i - 1])) / 2 + 14 : 21));
    const choices = sets.slice(high - low < 1.3 ? 0 : 1).map(places);
    if (choices[0].length < 3) return null;
    const labelled = choices.map(marks => ({ marks, texts: label(marks) }));
    const { marks, texts } = labelled.find(fits) || labelled.at(-1);
    const between = high - low > 8 ? [] : places([[1, 2, 3, 4, 5, 6, 7, 8, 9], 1]);
    const number = ({ mantissa, exponent }) => Number(`${mantissa}e${exponent}`);
    return { tickvals: marks.map(number), ticktext: texts, between: between.map(number) };
  };

  // Plotly reads the nearest point, but of a held quantity the one before counts: it gets a point wherever another
  // curve of its axis has one, and some between.
  const holdForReading = (trace, data, layout) => {
    const { x, y, text } = trace;
    if (x.length < 2 || x.includes(null)) return null;
    const axis = layout[trace.xaxis.replace('x', 'xaxis')];
    const [first, last] = axis.range;
    const grid = Array.from({ length: 500 }, (_, i) => first + ((last - first) * i) / 500)
      .map(at => (axis.type === 'log' ? 10 ** at : at));
    const others = data.filter(other => other.type === 'scatter' && other.xaxis === trace.xaxis);
    const inside = [...grid, ...others.flatMap(other => other.x)].filter(at => at > x[0] && at < x.at(-1));
    const own = new Set(x);
    const extra = [...new Set(inside)].filter(at => !own.has(at)).sort((a, b) => a - b);
    const held = { x: [], y: [], text: [] };
    const add = (at, i) => {
      held.x.push(at);
      held.y.push(y[i]);
      held.text.push(text?.[i]);
    };
    let next = 0;
    x.forEach((at, i) => {
      add(at, i);
      for (; i + 1 < x.length && extra[next] < x[i + 1]; next += 1) add(extra[next], i);
    });
    return text ? held : { x: held.x, y: held.y };
  };

  const setUp = figure => {
    const { data, layout, steps, logs } = JSON.parse(figure.querySelector('script.data').textContent);
    data.map(trace => (trace.line?.shape === 'hv' ? holdForReading(trace, data, layout) : null))
      .forEach((held, i) => Object.assign(data[i], held));
    // The centre of a cell as Plotly reads it is not that of a logarithmic axis, and values may be logarithms.
    for (const trace of data.filter(one => one.type === 'heatmap' && one.meta)) {
      const { x, y, values } = trace.meta;
      trace.customdata = values.map((row, i) => row.map((text, k) => [x[k], y[i], text]));
    }
    const live = figure.querySelector('.live');
    const drawn = figure.querySelector('.drawn');
    const plot = live.querySelector('.plot');
    const keys = all('button.key', live);
    const hidden = new Set();
    const numbers = data.filter(trace => trace.meta?.cells).map(trace => [trace, trace.text]);
    const config = {
      responsive: true, displaylogo: false, displayModeBar: true, doubleClick: 'reset', showTips: false,
      modeBarButtons: [['zoom2d', 'pan2d'], ['zoomIn2d', 'zoomOut2d', 'resetScale2d'], ['toImage']],
      toImageButtonOptions: { filename: figure.id, scale: 2 },
    };
    plot.style.height = `${layout.height}px`;

    // Marks at multiples of a step, fewer where they would not fit, automatic ones in a view of few steps.
    const marked = [...Object.keys(steps), ...logs];
    const ticks = (name, range, pixels) => {
      if (logs.includes(name)) {
        const marks = decades(range, pixels, name[0] === 'x');
        const between = { tickmode: 'array', tickvals: marks?.between ?? [], ticks: 'outside', ticklen: 2.5 };
        return marks ? { tickmode: 'array', tickvals: marks.tickvals, ticktext: marks.ticktext, minor: between }
          : { tickmode: 'auto', tickvals: null, ticktext: null, minor: between };
      }
      const span = Math.abs(range[1] - range[0]);
      const densest = Math.max(1, pixels / (name[0] === 'x' ? 42 : 24));
      const step = steps[name] * Math.max(1, Math.ceil(span / steps[name] / densest));
      return span / step < 2 ? { tickmode: 'auto', dtick: null } : { tickmode: 'linear', dtick: step };
    };
    // A view between the places of a sweep has marks of its own where these places are numbers.
    const named = Object.keys(layout).filter(name => layout[name]?.type === 'log'
      && layout[name].tickmode === 'array' && !marked.includes(name));
    const placed = (name, [from, to]) => layout[name].tickvals.map(Math.log10)
      .some(at => at >= Math.min(from, to) && at <= Math.max(from, to));
    // On a narrow screen a horizontal title has lines no longer than its axis, or it would be cut off.
    const titled = name => {
      const { text } = layout[name].title;
      const room = plot._fullLayout?.[name]?._length ?? plot.clientWidth - 80;
      if (name[0] !== 'x' || room >= 300) return text;
      const lines = [''];
      for (const word of text.replaceAll('<br>', ' ').split(' ')) {
        const longer = `${lines.at(-1)} ${word}`.trim();
        if (7.4 * longer.replace(/<[^>]*>/g, '').length > room && lines.at(-1)) lines.push(word);
        else lines[lines.length - 1] = longer;
      }
      return lines.join('<br>');
    };
    // Automatic marks of a horizontal axis are fewer where their texts would touch. Fewer marks have shorter texts, so that
    // in one view their number only falls.
    const views = new Map();
    const thinned = axis => {
      const view = `${axis.range} ${Math.round(axis._length)}`;
      const isNew = views.get(axis._id) !== view;
      views.set(axis._id, view);
      if (isNew && axis.nticks) return 0;
      const widest = Math.max(0, ...all(`.${axis._id}tick text`, plot).map(text => text.getBBox().width));
      const places = (axis._vals || []).map(mark => axis.l2p(mark.x)).sort((a, b) => a - b);
      const isCrowded = places.some((at, i) => i > 0 && at - places[i - 1] < widest + 8);
      const most = Math.floor(axis._length / (widest + 8));
      if (!isCrowded || places.length < 3) return axis.nticks;
      return Math.max(2, Math.min(most, places.length - 1, axis.nticks || Infinity));
    };
    const adapt = () => {
      const change = {};
      for (const name of Object.keys(layout).filter(one => one.startsWith('xaxis'))) {
        const axis = plot._fullLayout[name];
        const wanted = axis.tickmode === 'auto' ? thinned(axis) : axis.nticks;
        if (wanted !== axis.nticks) change[`${name}.nticks`] = wanted;
      }
      for (const name of Object.keys(layout).filter(one => one.startsWith('xaxis') && layout[one].title)) {
        const wanted = titled(name);
        if (plot._fullLayout[name].title.text !== wanted) change[`${name}.title.text`] = wanted;
      }
      for (const name of marked) {
        const axis = plot._fullLayout[name];
        const wanted = ticks(name, axis.range, axis._length);
        if (wanted.tickmode !== axis.tickmode || (wanted.dtick && wanted.dtick !== axis.dtick)
          || (wanted.tickvals && String(wanted.tickvals) !== String(axis.tickvals))) {
          for (const [key, part] of Object.entries(wanted)) change[`${name}.${key}`] = part;
        }
      }
      for (const name of named) {
        const axis = plot._fullLayout[name];
        const mode = placed(name, axis.range) ? 'array' : 'auto';
        if (mode !== axis.tickmode) change[`${name}.tickmode`] = mode;
      }
      if (Object.keys(change).length) Plotly.relayout(plot, change);
      // Numbers stand in cells where all have the room, as in the drawn figure; half a number would be another one.
      for (const [trace, texts] of numbers) {
        const [x, y] = [trace.xaxis, trace.yaxis].map(name => plot._fullLayout[name.replace(/^./, '$&axis')]);
        const half = text => 3.6 * text.length;
        const cramped = trace.meta.cells.some(([left, right, bottom, top], i) =>
          Math.abs(x.c2p(right) - x.c2p(left)) < 2 * half(texts[i]) + 4 || Math.abs(y.c2p(top) - y.c2p(bottom)) < 15);
        const inside = (at, axis, room) => axis.c2p(at) > room && axis.c2p(at) < axis._length - room;
        const text = texts.map((one, i) =>
          (!cramped && inside(trace.x[i], x, half(one)) && inside(trace.y[i], y, 7) ? one : ''));
        if (String(text) === String(trace.text)) continue;
        trace.text = text;
        Plotly.restyle(plot, { text: [text] }, [data.indexOf(trace)]);
      }
    };
    // Names on a horizontal axis stand upright where one of their lines is wider than its place.
    const upright = ({ tickvals, ticktext, range }) => {
      const span = Math.abs(range[1] - range[0]);
      const apart = Math.min(span, ...tickvals.slice(1).map((at, i) => Math.abs(at - tickvals[i])));
      const room = (apart / span) * (plot.clientWidth - 90);
      const lines = ticktext.map(text => text.split('<br>'));
      const widest = Math.max(...lines.flat().map(line => 6.8 * line.replace(/<.*?>/g, '').length));
      if (widest + 6 <= room) return {};
      return { tickangle: -90, ticktext: lines.map(parts => parts.join(15 * parts.length > room ? ' ' : '<br>')) };
    };
    const draw = () => {
      const traces = data.map(trace => ({ ...translate(trace, ''), visible: !hidden.has(trace.legendgroup) }));
      const look = translate(layout, '');
      delete look.height;
      look.font.family = family;
      look.hoverlabel.font.family = family;
      look.dragmode = plot._fullLayout?.dragmode ?? (touch ? false : 'zoom');
      const isNarrow = plot.clientWidth < 520;
      for (const [name, axis] of Object.entries(look).filter(([one]) => /^[xy]axis/.test(one))) {
        if (axis.title) axis.title = { ...axis.title, text: titled(name) };
        if (isNarrow && name[0] === 'x' && axis.ticktext) Object.assign(axis, upright(axis));
        // Names of keys leave room for what is drawn.
        if (isNarrow && name[0] === 'y' && axis.ticktext) axis.ticktext = axis.ticktext.map(text => text.replace(/\.(?=[a-z])/g, '.<br>'));
      }
      // The first panel's own title stands below the buttons.
      const below = isNarrow && layout.annotations.some(note => note.yanchor === 'bottom' && note.y === 1 && note.xanchor === 'left') ? 24 : 0;
      look.margin = { ...look.margin, t: look.margin.t + below };
      plot.style.height = `${layout.height + below}px`;
      look.modebar = { bgcolor: 'rgba(0,0,0,0)', color: look.xaxis.tickcolor, activecolor: look.font.color };
      for (const name of marked) {
        const pixels = name[0] === 'x' ? plot.clientWidth - 80 : layout.height / 2;
        Object.assign(look[name], ticks(name, plot._fullLayout?.[name].range || look[name].range, pixels));
      }
      return Plotly.react(plot, traces, look, config);
    };
    const switched = () => {
      keys.forEach(key => key.setAttribute('aria-pressed', String(!hidden.has(key.dataset.group))));
      Plotly.restyle(plot, { visible: data.map(trace => !hidden.has(trace.legendgroup)) });
    };
    keys.forEach(key => {
      const group = key.dataset.group;
      key.addEventListener('click', event => {
        // The second click of two shows the series alone, or all of its panel again.
        const panel = keys.filter(other => other.parentNode === key.parentNode).map(other => other.dataset.group);
        if (event.detail === 2) {
          const alone = panel.every(other => other === group || hidden.has(other));
          panel.forEach(other => (alone || other === group ? hidden.delete(other) : hidden.add(other)));
          if (alone) hidden.delete(group);
        } else if (!hidden.delete(group)) {
          hidden.add(group);
        }
        switched();
      });
    });
    live.hidden = false;
    draw().then(() => {
      drawn.hidden = true;
      charts.push({ draw: () => draw().then(adapt) });
      plot.on('plotly_relayout', adapt);
      adapt();
    }).catch(error => {
      // The drawn figure stays.
      live.hidden = true;
      console.error(error);
    });
  };
  // One after the other, so that the page can be used meanwhile.
  const waiting = all('figure.chart');
  const next = () => {
    const figure = waiting.shift();
    if (!figure) {
      root.dataset.ready = '';
      return;
    }
    try {
      setUp(figure);
    } catch (error) {
      figure.querySelector('.live').hidden = true;
      console.error(error);
    }
    setTimeout(next);
  };
  themed();
  if (window.Plotly) next(); else root.dataset.ready = '';
})();

import 'uplot/dist/uPlot.min.css';
import './style.css';
import { byId, element } from './dom';
import { RunPayload, SweepPayload } from './payload';
import { showRun } from './run';
import { showSweep } from './sweep';

async function main(): Promise<void> {
  const payload = JSON.parse(byId('data').textContent ?? '') as RunPayload | SweepPayload;
  if (payload.kind === 'run') await showRun(payload);
  else await showSweep(payload);
  document.documentElement.dataset.ready = 'yes';
}

main().catch((error: unknown) => {
  const text = 'The interactive part did not start: ' + String(error);
  document.querySelector('main')?.prepend(element('p', { class: 'notice' }, text));
  console.error(error);
});

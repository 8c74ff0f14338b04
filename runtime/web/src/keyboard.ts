// Keys, where nobody is typing.

let is_clicked = false; // what has the focus got it by a click, and is not meant by space

const is_own = (event: KeyboardEvent, target: HTMLElement): boolean => {
  if (target.matches('select, input[type=text], input[type=number]')) return true;
  if (target.matches('input[type=range], input[type=radio]') && event.key.startsWith('Arrow')) return true;
  if (target.matches('a, button') && event.key === 'Enter') return true;
  return event.key === ' ' && !is_clicked && target.matches('button, input:not([type=range])');
};

/** Calls what the key stands for: a key's name, with "Shift+" before it where that is meant. */
export function on_keys(actions: Record<string, () => void>): void {
  window.addEventListener('pointerdown', () => (is_clicked = true), { capture: true });
  window.addEventListener('keydown', (event) => {
    if (event.key === 'Tab') is_clicked = false;
    if (event.ctrlKey || event.altKey || event.metaKey || is_own(event, event.target as HTMLElement)) return;
    const action = event.shiftKey && event.key.startsWith('Arrow') ? actions[`Shift+${event.key}`] : actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
  // A button is pressed when space is let go: not after it was for the run.
  window.addEventListener('keyup', (event) => {
    const target = event.target as HTMLElement;
    if (event.key === ' ' && target.matches('button, input:not([type=range])') && is_clicked) event.preventDefault();
  });
}

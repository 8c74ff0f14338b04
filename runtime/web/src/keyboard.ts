// Keys, where nobody is typing.

const is_own = (event: KeyboardEvent, target: HTMLElement): boolean => {
  if (target.matches('select, input[type=text], input[type=number]')) return true;
  if (target.matches('input[type=range], input[type=radio]') && event.key.startsWith('Arrow')) return true;
  if (target.matches('a, button') && event.key === 'Enter') return true;
  // After a click a control has the focus, but not of the keyboard: space is then for the run.
  return event.key === ' ' && target.matches('button, input:not([type=range])') && target.matches(':focus-visible');
};

/** Calls what the key stands for: a key's name, with "Shift+" before it where that is meant. */
export function on_keys(actions: Record<string, () => void>): void {
  window.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || is_own(event, event.target as HTMLElement)) return;
    const action = event.shiftKey && event.key.startsWith('Arrow') ? actions[`Shift+${event.key}`] : actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
  // A button is pressed when space is let go: not after it was for the run.
  window.addEventListener('keyup', (event) => {
    const target = event.target as HTMLElement;
    if (event.key === ' ' && target.matches('button, input:not([type=range])') && !target.matches(':focus-visible')) event.preventDefault();
  });
}

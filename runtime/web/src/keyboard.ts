// Keys, where nobody is typing.

/** Calls what the key stands for. */
export function on_keys(actions: Record<string, () => void>): void {
  window.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const target = event.target as HTMLElement;
    if (target.matches('select, input[type=text], input[type=number]')) return;
    if (target.matches('input[type=range]') && event.key.startsWith('Arrow')) return;
    if (event.key === ' ' && target.matches('button, input:not([type=range])')) return;
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}

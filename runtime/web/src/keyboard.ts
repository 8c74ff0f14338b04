// Keys, where nobody is typing.

/** Calls what the key stands for. */
export function on_keys(actions: Record<string, () => void>): void {
  window.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const target = event.target as HTMLElement;
    if (target.matches('select, textarea, input:not([type=checkbox]):not([type=radio])')) return;
    if (event.key === ' ' && target.matches('button, input')) return;
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}

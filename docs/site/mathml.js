// Formulas to MathML, for mathml.py: reads {"tex", "display"} and writes {"mathml"} or {"problem"}, one JSON object per line.
const katex = require('/usr/share/nodejs/katex');

// Browsers take bold letters only as characters of their own.
const bold_letters = [['A', 'Z', 0x1d400], ['a', 'z', 0x1d41a], ['0', '9', 0x1d7ce], ['Α', 'Ω', 0x1d6a8], ['α', 'ω', 0x1d6c2]];
function bold(text) {
  const letter = (c) => {
    const found = bold_letters.find(([first, last]) => first <= c && c <= last);
    return found ? String.fromCodePoint(found[2] + c.charCodeAt(0) - found[0].charCodeAt(0)) : c;
  };
  return [...text].map(letter).join('');
}

require('readline').createInterface({ input: process.stdin }).on('line', (line) => {
  const { tex, display } = JSON.parse(line);
  let answer;
  try {
    const html = katex.renderToString(tex, { output: 'mathml', displayMode: display, throwOnError: true, strict: false });
    const mathml = html.replace(/^<span class="katex">|<\/span>$/g, '');
    answer = { mathml: mathml.replace(/ mathvariant="bold(?:-italic)?">([^<&]+)</g, (_, text) => `>${bold(text)}<`) };
  } catch (problem) {
    answer = { problem: problem.message };
  }
  process.stdout.write(JSON.stringify(answer) + '\n');
});

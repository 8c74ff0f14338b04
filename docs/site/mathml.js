// Formulas to MathML, for mathml.py: reads {"tex", "display"} and writes {"mathml"} or {"problem"}, one JSON object per line.
const katex = require('/usr/share/nodejs/katex');

require('readline').createInterface({ input: process.stdin }).on('line', (line) => {
  const { tex, display } = JSON.parse(line);
  let answer;
  try {
    const html = katex.renderToString(tex, { output: 'mathml', displayMode: display, throwOnError: true, strict: false });
    answer = { mathml: html.replace(/^<span class="katex">|<\/span>$/g, '') };
  } catch (problem) {
    answer = { problem: problem.message };
  }
  process.stdout.write(JSON.stringify(answer) + '\n');
});

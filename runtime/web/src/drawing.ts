// A body that is drawn: dark on white paper, as a picture that a body in the plane is made of.
import { element } from './dom';

const [width, height] = [720, 480]; // of the paper [px]
const pens = { least: 6, usual: 30, most: 90 }; // [px]
const closes = 2; // [pens] a line that ends as near to where it began is the outline of what is filled

type Place = [number, number];

export class Drawing {
  readonly dialog = element('dialog', '', { className: 'drawing card' });
  private readonly paper_ = element('canvas', '', { width, height });
  private readonly size_ = element('input', '', { type: 'range', min: String(pens.least), max: String(pens.most), value: String(pens.usual) });
  private readonly rubber_ = element('input', '', { type: 'checkbox' });
  private readonly drop_ = element('button', 'Drop it', { title: 'Make a body of it that falls, and that you can push and dent' });
  private line_: Place[] = []; // that is being drawn

  /** `done` takes the picture. */
  constructor(done: (picture: File) => void) {
    const clear = element('button', 'Clear');
    const cancel = element('button', 'Cancel');
    const sized = element('label', 'Pen ');
    const rubbed = element('label', '');
    const tools = element('div', '', { className: 'tools' });
    sized.append(this.size_);
    rubbed.append(this.rubber_, ' rubber');
    tools.append(sized, rubbed, clear, element('span', '', { className: 'apart' }), cancel, this.drop_);
    this.paper_.setAttribute('role', 'img');
    this.paper_.setAttribute('aria-label', 'Paper to draw on with the pointer; instead, a picture can be added as a file');
    this.dialog.setAttribute('aria-label', 'Draw a body');
    this.dialog.append(element('h2', 'Draw a body in one piece; a closed line is filled'), this.paper_, tools);
    for (const [name, one] of Object.entries({ drawing: this.dialog, paper: this.paper_, 'pen-size': this.size_, rubber: this.rubber_, clear, 'drop-it': this.drop_ })) one.dataset.testid = name;
    clear.onclick = () => this.clear();
    cancel.onclick = () => this.dialog.close();
    this.drop_.onclick = () => this.paper_.toBlob((picture) => {
      this.dialog.close();
      if (picture) done(new File([picture], 'drawing.png'));
    });
    this.listen();
  }

  open(): void {
    this.clear();
    this.dialog.showModal();
  }

  private get pen(): CanvasRenderingContext2D {
    return this.paper_.getContext('2d')!;
  }

  private clear(): void {
    this.pen.fillStyle = 'white';
    this.pen.fillRect(0, 0, width, height);
    this.drop_.disabled = true;
  }

  private listen(): void {
    const paper = this.paper_;
    const place = ({ clientX, clientY }: PointerEvent): Place => {
      const area = paper.getBoundingClientRect();
      return [((clientX - area.left) / area.width) * width, ((clientY - area.top) / area.height) * height];
    };
    paper.onpointerdown = (event) => {
      paper.setPointerCapture(event.pointerId);
      this.line_ = [place(event)];
      this.draw();
    };
    paper.onpointermove = (event) => {
      if (this.line_.length === 0) return;
      this.line_.push(...event.getCoalescedEvents().map(place), place(event));
      this.draw();
    };
    paper.onpointerup = () => {
      this.fill();
      this.line_ = [];
    };
    paper.onpointercancel = () => (this.line_ = []);
  }

  private draw(): void {
    const { pen } = this;
    pen.strokeStyle = pen.fillStyle = this.rubber_.checked ? 'white' : 'black';
    pen.lineWidth = Number(this.size_.value);
    pen.lineCap = pen.lineJoin = 'round';
    pen.beginPath();
    pen.moveTo(...this.line_[0]!);
    for (const at of this.line_) pen.lineTo(...at);
    pen.stroke();
    this.drop_.disabled = false;
  }

  /** What the line goes around. */
  private fill(): void {
    const [first, last] = [this.line_[0], this.line_.at(-1)];
    if (!first || !last || this.line_.length < 3) return;
    const apart = Math.hypot(last[0] - first[0], last[1] - first[1]);
    if (apart < closes * Number(this.size_.value)) this.pen.fill();
  }
}

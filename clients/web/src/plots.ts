import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

/** `least`: what its axis shows at least. */
interface Curve { label: string; colour: string; scale: string; least: number }

function css(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** A small plot of some curves over time, in the page's colours. */
export class TimePlot {
  private plot: uPlot | undefined;
  private data: uPlot.AlignedData = [[]];
  private marks: readonly number[] = [];
  private cursor_s: number | undefined;

  constructor(
    private readonly box: HTMLElement,
    private readonly curves: readonly Curve[],
    private readonly fixed: Readonly<Record<string, [number, number]>> = {},
  ) {
    new ResizeObserver(() => this.plot?.setSize(this.size())).observe(box);
    this.rebuild();
  }

  /** Time in s, then one row a curve; vertical marks at some times. */
  set(data: uPlot.AlignedData, marks: readonly number[] = []): void {
    this.data = data;
    this.marks = marks;
    this.plot?.setData(data);
  }

  /** Where a motion is now; undefined: nowhere. */
  setCursor(time_s: number | undefined): void {
    if (this.cursor_s === time_s) return;
    this.cursor_s = time_s;
    this.plot?.redraw(false);
  }

  /** For a new theme. */
  rebuild(): void {
    this.plot?.destroy();
    const text = css("--muted");
    const line = css("--line");
    const scales: uPlot.Scales = { x: { time: false } };
    const axes: uPlot.Axis[] = [{ stroke: text, grid: { show: false }, ticks: { stroke: line }, size: 26, font: "11px system-ui" }];
    const series: uPlot.Series[] = [{}];
    this.curves.forEach((curve, i) => {
      const range = this.fixed[curve.scale];
      scales[curve.scale] = range !== undefined ? { range } : { range: (_plot, _low, high) => [0, Math.max(curve.least, high * 1.1)] };
      axes.push({ scale: curve.scale, side: i === 0 ? 3 : 1, stroke: css(curve.colour), grid: { show: i === 0, stroke: line, width: 1 }, ticks: { show: false }, size: 40, font: "11px system-ui", label: curve.label, labelSize: 14, labelFont: "11px system-ui", labelGap: 0 });
      series.push({ label: curve.label, scale: curve.scale, stroke: css(curve.colour), width: 1.6, points: { show: false } });
    });
    const options: uPlot.Options = {
      ...this.size(), scales, axes, series, cursor: { show: false }, legend: { show: false }, padding: [8, 2, 0, 2],
      hooks: { draw: [(plot) => this.drawMarks(plot)] },
    };
    this.plot = new uPlot(options, this.data, this.box);
  }

  private size(): { width: number; height: number } {
    return { width: Math.max(80, this.box.clientWidth), height: Math.max(60, this.box.clientHeight) };
  }

  private drawMarks(plot: uPlot): void {
    const { ctx, bbox } = plot;
    const rule = (time_s: number, colour: string, width: number): void => {
      const x = plot.valToPos(time_s, "x", true);
      if (!(x >= bbox.left && x <= bbox.left + bbox.width)) return;
      ctx.save();
      ctx.strokeStyle = colour;
      ctx.lineWidth = width * devicePixelRatio;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.restore();
    };
    for (const mark of this.marks) rule(mark, css("--control"), 1);
    if (this.cursor_s !== undefined) rule(this.cursor_s, css("--orange"), 2);
  }
}

/** The last seconds of some values. */
export class Recent {
  private readonly rows: number[][];
  private first_s: number | undefined;

  constructor(
    curves: number,
    private readonly span_s: number,
  ) {
    this.rows = Array.from({ length: curves + 1 }, () => []);
  }

  add(time_s: number, values: readonly number[]): void {
    this.first_s ??= time_s;
    this.rows.forEach((row, i) => row.push(i === 0 ? time_s - (this.first_s ?? 0) : (values[i - 1] ?? 0)));
    const times = this.rows[0] ?? [];
    const now = times[times.length - 1] ?? 0;
    let old = 0;
    while (old < times.length && now - (times[old] ?? 0) > this.span_s) ++old;
    if (old > 0) for (const row of this.rows) row.splice(0, old);
  }

  data(): uPlot.AlignedData {
    return this.rows.map((row) => row.slice()) as unknown as uPlot.AlignedData;
  }
}

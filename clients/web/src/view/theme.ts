// The picture's colours, for light and dark; the page's own stand in style.css.
export interface Palette {
  background: number; grid: number; gridMain: number; table: number; body: number; seen: number;
  trial: number; answer: number; objective: number; sigma: number; plan: number; measured: number; handle: number;
}

export const light: Palette = {
  background: 0xeef1f5, grid: 0xd5dbe3, gridMain: 0xbfc8d4, table: 0xd9d3c8, body: 0x9aa5b4, seen: 0x3c4757,
  trial: 0x8691a0, answer: 0x1763d6, objective: 0x7a2bd1, sigma: 0x1763d6, plan: 0x0c7a60, measured: 0xd9600a, handle: 0x1763d6,
};

export const dark: Palette = {
  background: 0x10151c, grid: 0x222b37, gridMain: 0x303b4a, table: 0x3a3833, body: 0x5f6b7b, seen: 0xc9d3e0,
  trial: 0x76828f, answer: 0x6eaaff, objective: 0xc493ff, sigma: 0x6eaaff, plan: 0x45cba6, measured: 0xffa04d, handle: 0x6eaaff,
};

export function rgb(colour: number): [number, number, number] {
  return [((colour >> 16) & 255) / 255, ((colour >> 8) & 255) / 255, (colour & 255) / 255];
}

/** Numbers for people. A missing or infinite one is a dash. */
export function number(value: number | undefined, digits: number, unit = ""): string {
  if (value === undefined || !Number.isFinite(value)) return "–";
  return `${value.toFixed(digits)}${unit === "" ? "" : ` ${unit}`}`;
}

export const mm = (metres: number | undefined): string => number(metres === undefined ? undefined : metres * 1e3, 1, "mm");
export const cm = (metres: number | undefined): string => number(metres === undefined ? undefined : metres * 1e2, 2, "cm");
export const seconds = (value: number | undefined): string => number(value, value !== undefined && value >= 100 ? 0 : 1, "s");

export function bytes(count: number): string {
  const units = ["B", "kB", "MB", "GB", "TB"];
  let value = count;
  let unit = 0;
  while (value >= 1000 && unit < units.length - 1) {
    value /= 1000;
    unit += 1;
  }
  return `${unit === 0 ? value.toFixed(0) : value.toPrecision(3)} ${units[unit] ?? ""}`;
}

/** protobuf's JSON writes 64-bit numbers as text, and "NaN", "Infinity". */
export function toNumber(value: number | string | undefined): number {
  return value === undefined ? Number.NaN : Number(value);
}

/** "protective_stop" -> "protective stop". */
export function words(name: string): string {
  return name.replaceAll("_", " ");
}

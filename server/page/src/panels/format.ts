// Numbers and names as text.

export function formatLength(value: number): string {
  if (value > 0 && value < 1e-5) return `${(value * 1e6).toFixed(1)} µm`;
  if (value > 0 && value < 0.01) return `${(value * 1000).toFixed(2)} mm`;
  if (value < 1) return `${(value * 100).toFixed(1)} cm`;
  return `${value.toFixed(2)} m`;
}

export function formatTime(seconds: number): string {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(1).padStart(4, "0")}`;
}

/** The last two parts of a path, which identify an object for a reader. */
export function shortenPath(path: string): string {
  const parts = path.split("/");
  return parts.slice(-2).join(" / ") || path;
}

export function getLastName(path: string): string {
  return path.split("/").at(-1) || path;
}

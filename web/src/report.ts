import type { Page } from "./data";

async function main(): Promise<void> {
  const packed = document.getElementById("data")!.textContent!.trim();
  const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const page = (await new Response(stream).json()) as Page;
  document.title = page.title;
}

void main();

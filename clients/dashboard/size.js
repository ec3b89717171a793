/** Fails where the built page is larger than 250 kB, compressed as it is sent. */

import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const BYTES_MAX = 250_000;
const built = fileURLToPath(new URL("../../target/dashboard", import.meta.url));

const files = readdirSync(built, { recursive: true, withFileTypes: true })
  .filter((entry) => entry.isFile())
  .map((entry) => join(entry.parentPath, entry.name));
const bytes = files.reduce((sum, file) => sum + gzipSync(readFileSync(file)).length, 0);
console.log(`the page takes ${(bytes / 1000).toFixed(0)} kB compressed, of ${BYTES_MAX / 1000} kB`);
if (files.length === 0 || bytes > BYTES_MAX) {
  process.exit(1);
}
